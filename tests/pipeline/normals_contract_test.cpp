// What every estimator of normals of the registry keeps to, in every way that it works.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "base/config.h"
#include "base/math.h"
#include "pipeline/kernels/target.h"
#include "pipeline/registry.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/heap_guard.h"

namespace grapnel {
namespace {

constexpr int kWidth = 80;
constexpr int kHeight = 60;

/// A wavy sheet about 1 m before a camera, a reading in every pixel.
test::OwnedSurface full_grid() {
  constexpr std::size_t kPixels = static_cast<std::size_t>(kWidth) * kHeight;
  test::OwnedSurface surface(kPixels, kPixels);
  surface->grid.width = kWidth;
  surface->grid.height = kHeight;
  surface->grid.intrinsics = {kWidth, kHeight, 70.0, 70.0, 39.5, 29.5};
  surface->has_viewpoint = true;
  surface->spacing_m = 1.0 / 70.0;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const std::size_t i = surface->size++;
      const double z = 1.0 + 0.02 * math::sin(0.2 * u) * math::cos(0.15 * v);
      surface->x[i] = static_cast<float>(z * (u - 39.5) / 70.0);
      surface->y[i] = static_cast<float>(z * (v - 29.5) / 70.0);
      surface->z[i] = static_cast<float>(z);
      surface->grid.point_of[i] = surface->grid.pixel_of[i] = static_cast<std::int32_t>(i);
    }
  }
  return surface;
}

/// A method, and one value of its key `by` where it has one.
struct Way {
  std::string method;
  std::string by;
};

std::vector<Way> ways() {
  std::vector<Way> all;
  for (const Method<NormalEstimator>& method : normal_estimators()) {
    const std::size_t before = all.size();
    for (const Field& field : method.fields()) {
      if (field.name != "by") continue;
      for (const std::string_view value : field.choices) {
        all.push_back({std::string(method.name), std::string(value)});
      }
    }
    if (all.size() == before) all.push_back({std::string(method.name), ""});
  }
  return all;
}

class EveryNormalEstimator : public testing::TestWithParam<Way> {
 protected:
  static std::unique_ptr<NormalEstimator> make() {
    ConfigTable table("", GetParam().method, 0);
    if (!GetParam().by.empty()) apply_override(table, "by=\"" + GetParam().by + "\"");
    ConfigReader reader(table);
    return find_method(normal_estimators(), GetParam().method).make(reader);
  }
  static Status estimate(Surface& surface, const Limits& limits = test::small_limits()) {
    const std::unique_ptr<NormalEstimator> estimator = make();
    const test::ArenaMemory memory([&](Arena& arena) { estimator->reserve(arena, limits); });
    return estimator->estimate(surface);
  }
  static bool needs_a_grid() { return GetParam().method != "pca"; }
};
void PrintTo(const Way& way, std::ostream* out) { *out << way.method << ' ' << way.by; }

INSTANTIATE_TEST_SUITE_P(OfTheRegistry, EveryNormalEstimator, testing::ValuesIn(ways()),
                         [](const auto& way) {
                           return way.param.method + (way.param.by.empty() ? "" : "_") +
                                  way.param.by;
                         });

TEST_P(EveryNormalEstimator, GivesUnitVectorsTowardTheCameraOrNone) {
  test::OwnedSurface grid = full_grid();
  ASSERT_TRUE(estimate(*grid).ok());
  std::size_t found = 0;
  for (std::size_t i = 0; i < grid->size; ++i) {
    if (!grid->has_normal(i)) continue;
    ++found;
    ASSERT_NEAR(grid->normal(i).norm(), 1.0F, 1e-5F) << i;
    ASSERT_GE(grid->normal(i).dot(grid->viewpoint - grid->point(i)), 0.0F) << i;
  }
  EXPECT_GT(2 * found, grid->size);
}

TEST_P(EveryNormalEstimator, FindsThatOfATiltedPlane) {
  test::OwnedSurface grid = full_grid();
  const Vec3d normal = Vec3d(0.3, -0.2, -1.0).normalized();
  for (std::size_t i = 0; i < grid->size; ++i) {
    // Along the pixel's ray, onto normal · p = -1.
    const Vec3d ray = grid->point(i).cast<double>();
    const Vec3f p = (ray * (-1.0 / normal.dot(ray))).cast<float>();
    grid->x[i] = p.x();
    grid->y[i] = p.y();
    grid->z[i] = p.z();
  }
  ASSERT_TRUE(estimate(*grid).ok());
  std::size_t found = 0;
  for (std::size_t i = 0; i < grid->size; ++i) {
    if (!grid->has_normal(i)) continue;
    ++found;
    // Coordinates in single precision, differences over a pixel's pitch of a centimetre.
    ASSERT_GT(grid->normal(i).cast<double>().dot(normal), 1.0 - 1e-6) << i;
  }
  EXPECT_GT(2 * found, grid->size);
}

TEST_P(EveryNormalEstimator, FollowsAScaleOfTwo) {
  test::OwnedSurface still = full_grid();
  test::OwnedSurface larger = full_grid();
  for (std::size_t i = 0; i < larger->size; ++i) {
    larger->x[i] *= 2.0F;
    larger->y[i] *= 2.0F;
    larger->z[i] *= 2.0F;
  }
  larger->spacing_m *= 2.0;
  ASSERT_TRUE(estimate(*still).ok());
  ASSERT_TRUE(estimate(*larger).ok());
  for (std::size_t i = 0; i < still->size; ++i) {
    ASSERT_LT((still->normal(i) - larger->normal(i)).norm(), 1e-4F) << i;
  }
}

TEST_P(EveryNormalEstimator, GivesTheSameBitsOnEveryTarget) {
  std::vector<Vec3f> first;
  for (const std::string& target : kernels::target_names()) {
    ASSERT_TRUE(kernels::force_target(target));
    test::OwnedSurface grid = full_grid();
    const bool ok = estimate(*grid).ok();
    ASSERT_TRUE(kernels::force_target(""));
    ASSERT_TRUE(ok);
    if (first.empty()) {
      for (std::size_t i = 0; i < grid->size; ++i) first.push_back(grid->normal(i));
    }
    for (std::size_t i = 0; i < grid->size; ++i) ASSERT_EQ(grid->normal(i), first[i]) << target;
  }
}

TEST_P(EveryNormalEstimator, EndsDegenerateSurfacesInANamedErrorOrFiniteNormals) {
  for (int shape = 0; shape < 7; ++shape) {
    SCOPED_TRACE(shape);
    test::OwnedSurface grid = full_grid();
    for (std::size_t i = 0; i < grid->size; ++i) {
      if (shape == 2) grid->x[i] = grid->y[i] = 0.0F;
      if (shape == 3) grid->x[i] = grid->y[i] = grid->z[i] = 0.5F;
      if (shape == 4) grid->z[i] = std::numeric_limits<float>::quiet_NaN();
    }
    if (shape == 0) grid->size = 0;
    if (shape == 1) {
      grid->size = 1;
      for (std::int32_t& point : grid->grid.point_of) point = point > 0 ? -1 : point;
    }
    if (shape == 5) grid->y[77] = std::numeric_limits<float>::infinity();
    if (shape == 6) grid->grid.width = grid->grid.height = 0;
    const Status status = estimate(*grid);
    const bool refused = shape == 0 || shape == 4 || (shape == 6 && needs_a_grid());
    if (refused) {
      EXPECT_FALSE(status.ok());
    }
    if (!status.ok()) {
      EXPECT_NE(status.error().code, Code::Ok);
      EXPECT_NE(status.error().code, Code::InternalFault);
      EXPECT_EQ(status.error().stage, Stage::Normals);
      continue;
    }
    for (std::size_t i = 0; i < grid->size; ++i) ASSERT_TRUE(grid->normal(i).allFinite()) << i;
  }
}

TEST_P(EveryNormalEstimator, RefusesASurfaceOverItsCapacity) {
  Limits limits = test::small_limits();
  limits.max_points = limits.max_input_points = limits.max_model_points = 100;
  limits.max_width = limits.max_height = 10;
  test::OwnedSurface grid = full_grid();
  const Status status = estimate(*grid, limits);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, Code::CapacityExceeded);
  EXPECT_EQ(status.error().stage, Stage::Normals);
}

TEST_P(EveryNormalEstimator, TakesNothingFromTheHeapAfterReserve) {
  if (!test::heap_guard_works()) GTEST_SKIP() << test::kNoHeapGuard;
  const std::unique_ptr<NormalEstimator> estimator = make();
  const test::ArenaMemory memory(
      [&](Arena& arena) { estimator->reserve(arena, test::small_limits()); });
  EXPECT_EQ(memory.measured_bytes(), memory.used_bytes());
  test::OwnedSurface grid = full_grid();
  test::arm_heap_guard();
  const bool ok = estimator->estimate(*grid).ok();
  test::disarm_heap_guard();
  EXPECT_TRUE(ok);
  EXPECT_EQ(test::heap_calls(), 0U);
}

}  // namespace
}  // namespace grapnel
