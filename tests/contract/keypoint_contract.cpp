// What every keypoint detector of the registry must hold to: a new one is tested here before its
// author writes a test.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>
#include <string>
#include <vector>

#include "pipeline/kernels/target.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/registry.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/heap_guard.h"

namespace grapnel {
namespace {

constexpr std::size_t kCapacity = 1500;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Limits limits() {
  Limits limits = test::small_limits();
  limits.max_model_points = limits.max_points;
  return limits;
}

/// A detector with its memory; its parameters the defaults, and `key=value` pairs.
struct Detection {
  std::unique_ptr<KeypointDetector> detector;
  KeypointSet keypoints;
  test::ArenaMemory memory;

  Detection(const std::string& name, const std::vector<std::string>& overrides,
            std::size_t capacity)
      : detector(make(name, overrides)), memory([&](Arena& arena) {
          detector->reserve(arena, limits());
          keypoints = KeypointSet(arena.take<Keypoint>(capacity));
        }) {}

  static std::unique_ptr<KeypointDetector> make(const std::string& name,
                                                const std::vector<std::string>& overrides) {
    ConfigTable table("test", "", 0);
    for (const std::string& assignment : overrides) apply_override(table, assignment);
    ConfigReader reader(table);
    return find_method(keypoint_detectors(), name).make(reader);
  }
  [[nodiscard]] std::vector<Vec3f> places(const Surface& surface) const {
    std::vector<Vec3f> list;
    for (const Keypoint& keypoint : keypoints) {
      list.push_back(surface.point(static_cast<std::size_t>(keypoint.point)) + keypoint.offset_m);
    }
    return list;
  }
  [[nodiscard]] std::vector<std::int32_t> points() const {
    std::vector<std::int32_t> list;
    for (const Keypoint& keypoint : keypoints) list.push_back(keypoint.point);
    std::sort(list.begin(), list.end());
    return list;
  }
};

/// Every detector, with both engines where it has two.
struct Variant {
  std::string method;
  std::vector<std::string> overrides;
};

std::vector<Variant> variants() {
  std::vector<Variant> all;
  for (const Method<KeypointDetector>& method : keypoint_detectors()) {
    const FieldTable fields = method.fields();
    const bool engines = std::any_of(fields.begin(), fields.end(),
                                     [](const Field& field) { return field.name == "engine"; });
    if (!engines) {
      all.push_back({std::string(method.name), {}});
      continue;
    }
    all.push_back({std::string(method.name), {"engine=fast"}});
    all.push_back({std::string(method.name), {"engine=reference"}});
  }
  return all;
}

std::string title(const testing::TestParamInfo<Variant>& info) {
  std::string text = info.param.method;
  for (const std::string& assignment : info.param.overrides) {
    text += '_';
    text += assignment.substr(assignment.find('=') + 1);
  }
  return text;
}

/// Normals and a painted pattern, both moved with the surface.
void finish(Surface& surface) {
  PcaNormals normals{{}};
  const test::ArenaMemory memory([&](Arena& arena) { normals.reserve(arena, limits()); });
  ASSERT_TRUE(normals.estimate(surface).ok());
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Vec3f p = surface.point(i);
    surface.intensity[i] = 0.5F + 0.2F * std::sin(60.0F * p.x()) * std::sin(50.0F * p.y()) +
                           0.2F * std::sin(70.0F * p.z());
  }
}

test::OwnedSurface ball() {
  test::OwnedSurface surface = test::bumpy_ball(3000, 0.2);
  finish(*surface);
  return surface;
}

/// A wavy sheet with a box before it.
test::OwnedSurface grid() {
  test::OwnedSurface surface = test::wavy_grid(90, 70, 4);
  for (std::size_t i = 0; i < surface->size; ++i) {
    const int u = surface->grid.pixel_of[i] % 90;
    const int v = surface->grid.pixel_of[i] / 90;
    if (u < 20 || u > 60 || v < 20 || v > 45) continue;
    // Along the pixel's ray.
    const float nearer = 0.7F / surface->z[i];
    surface->x[i] *= nearer;
    surface->y[i] *= nearer;
    surface->z[i] *= nearer;
  }
  finish(*surface);
  return surface;
}

std::size_t in_common(const std::vector<std::int32_t>& a, const std::vector<std::int32_t>& b) {
  std::vector<std::int32_t> common;
  std::set_intersection(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(common));
  return common.size();
}

class KeypointContract : public testing::TestWithParam<Variant> {
 protected:
  [[nodiscard]] Detection make(std::size_t capacity = kCapacity) const {
    return {GetParam().method, GetParam().overrides, capacity};
  }
  /// Uniform's cells and SIFT's cubes are fixed in space; NARF sees one side.
  [[nodiscard]] bool moves_with_the_surface() const {
    return GetParam().method != "uniform" && GetParam().method != "sift3d" &&
           GetParam().method != "narf";
  }
  void expect_a_clean_answer(Surface& surface) const {
    Detection d = make();
    const Status status = d.detector->detect(surface, d.keypoints);
    if (!status.ok()) {
      EXPECT_NE(status.error().code, Code::InternalFault);
      EXPECT_EQ(status.error().stage, Stage::Keypoints);
      EXPECT_TRUE(d.keypoints.empty());
      return;
    }
    for (const Keypoint& keypoint : d.keypoints) {
      EXPECT_GE(keypoint.point, 0);
      EXPECT_LT(static_cast<std::size_t>(keypoint.point), surface.size);
      EXPECT_TRUE(std::isfinite(keypoint.score));
      EXPECT_TRUE(keypoint.offset_m.allFinite());
    }
  }
};
void PrintTo(const Variant& variant, std::ostream* out) { *out << variant.method; }

INSTANTIATE_TEST_SUITE_P(EveryDetector, KeypointContract, testing::ValuesIn(variants()), title);

TEST_P(KeypointContract, FindsSomethingOnABumpyBallAndOnAGrid) {
  for (const bool on_grid : {false, true}) {
    test::OwnedSurface surface = on_grid ? grid() : ball();
    Detection d = make();
    ASSERT_TRUE(d.detector->detect(*surface, d.keypoints).ok());
    EXPECT_GT(d.keypoints.size(), on_grid ? 1U : 3U) << (on_grid ? "grid" : "ball");
    EXPECT_FALSE(d.keypoints.overflowed());
    EXPECT_TRUE(
        std::is_sorted(d.keypoints.begin(), d.keypoints.end(),
                       [](const Keypoint& a, const Keypoint& b) { return a.point < b.point; }));
  }
}

TEST_P(KeypointContract, GivesTheSameBitsOnEveryTarget) {
  test::OwnedSurface surface = grid();
  Detection d = make();
  std::vector<Keypoint> first;
  for (const std::string& target : kernels::target_names()) {
    ASSERT_TRUE(kernels::force_target(target));
    ASSERT_TRUE(d.detector->detect(*surface, d.keypoints).ok());
    if (first.empty()) first.assign(d.keypoints.begin(), d.keypoints.end());
    ASSERT_EQ(d.keypoints.size(), first.size()) << target;
    for (std::size_t i = 0; i < first.size(); ++i) {
      EXPECT_EQ(d.keypoints[i].point, first[i].point);
      EXPECT_EQ(d.keypoints[i].score, first[i].score) << target;
      EXPECT_EQ(d.keypoints[i].offset_m, first[i].offset_m);
    }
  }
  ASSERT_TRUE(kernels::force_target(""));
}

TEST_P(KeypointContract, FollowsARigidMotion) {
  if (!moves_with_the_surface()) GTEST_SKIP() << "bound to the axes or to one view by definition";
  test::OwnedSurface still = ball();
  test::OwnedSurface moved = ball();
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(2.0, Vec3d(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
  pose.translation() = Vec3d(0.5, 0.1, -0.4);
  test::move(*moved, pose);
  Detection d = make();
  ASSERT_TRUE(d.detector->detect(*still, d.keypoints).ok());
  const std::vector<std::int32_t> before = d.points();
  ASSERT_TRUE(d.detector->detect(*moved, d.keypoints).ok());
  const std::vector<std::int32_t> after = d.points();
  // A neighbour on a sphere's rim may fall to either side by rounding; hardly any does.
  EXPECT_GE(in_common(before, after) * 10, 9 * std::max(before.size(), after.size()));
}

TEST_P(KeypointContract, DoesNotDependOnTheOrderOfThePoints) {
  if (GetParam().method == "uniform") GTEST_SKIP() << "ties within a cell go to the lower index";
  test::OwnedSurface still = ball();
  test::OwnedSurface turned = ball();
  const std::size_t n = still->size;
  for (std::span<float> Surface::*plane : {&Surface::x, &Surface::y, &Surface::z, &Surface::nx,
                                           &Surface::ny, &Surface::nz, &Surface::intensity}) {
    std::reverse(((*turned).*plane).begin(),
                 ((*turned).*plane).begin() + static_cast<std::ptrdiff_t>(n));
  }
  Detection d = make();
  ASSERT_TRUE(d.detector->detect(*still, d.keypoints).ok());
  const std::vector<Vec3f> before = d.places(*still);
  ASSERT_TRUE(d.detector->detect(*turned, d.keypoints).ok());
  const std::vector<Vec3f> after = d.places(*turned);
  const auto common = std::count_if(before.begin(), before.end(), [&](const Vec3f& place) {
    return std::any_of(after.begin(), after.end(),
                       [&](const Vec3f& other) { return (place - other).norm() < 1e-5F; });
  });
  // Sums run in another order; a score may turn on its last bit.
  EXPECT_GE(static_cast<std::size_t>(common) * 20, 19 * std::max(before.size(), after.size()));
}

TEST_P(KeypointContract, FollowsAScaleOfTwo) {
  if (GetParam().method == "uniform") GTEST_SKIP() << "half a cell's border moves";
  test::OwnedSurface still = ball();
  test::OwnedSurface larger = ball();
  for (std::size_t i = 0; i < larger->size; ++i) {
    larger->x[i] *= 2.0F;
    larger->y[i] *= 2.0F;
    larger->z[i] *= 2.0F;
  }
  larger->spacing_m *= 2.0;
  Detection d = make();
  ASSERT_TRUE(d.detector->detect(*still, d.keypoints).ok());
  const std::vector<std::int32_t> before = d.points();
  ASSERT_TRUE(d.detector->detect(*larger, d.keypoints).ok());
  const std::vector<std::int32_t> after = d.points();
  EXPECT_GE(in_common(before, after) * 10, 9 * std::max(before.size(), after.size()));
}

TEST_P(KeypointContract, AnswersDegenerateSurfacesCleanly) {
  const auto make_points = [](std::size_t n, auto place) {
    test::OwnedSurface surface(n, 0);
    surface->size = n;
    surface->spacing_m = 0.01;
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3f p = place(static_cast<float>(i));
      surface->x[i] = p.x();
      surface->y[i] = p.y();
      surface->z[i] = p.z();
      surface->nz[i] = -1.0F;
      surface->intensity[i] = 0.5F;
    }
    return surface;
  };
  std::vector<test::OwnedSurface> surfaces;
  surfaces.push_back(make_points(1, [](float) { return Vec3f(0.1F, 0.2F, 1.0F); }));
  surfaces.push_back(make_points(2, [](float i) { return Vec3f(0.01F * i, 0.0F, 1.0F); }));
  surfaces.push_back(make_points(500, [](float) { return Vec3f(0.1F, 0.2F, 1.0F); }));
  surfaces.push_back(make_points(500, [](float i) { return Vec3f(0.01F * i, 0.0F, 1.0F); }));
  surfaces.push_back(make_points(900, [](float i) {
    const float row = std::floor(i / 30.0F);
    return Vec3f(0.01F * (i - 30.0F * row), 0.01F * row, 1.0F);
  }));
  surfaces.push_back(make_points(300, [](float i) { return Vec3f(1e6F * i, -1e6F * i, 1e7F); }));
  surfaces.push_back(make_points(300, [](float i) { return Vec3f(1e-9F * i, 0.0F, 1e-9F); }));
  surfaces.push_back(make_points(300, [](float) { return Vec3f(kNan, kNan, kNan); }));
  surfaces.push_back(make_points(300, [](float i) {
    return i == 150.0F ? Vec3f(kNan, 0.0F, 1.0F) : Vec3f(0.01F * i, 0.0F, 1.0F);
  }));
  for (test::OwnedSurface& surface : surfaces) expect_a_clean_answer(*surface);
}

TEST_P(KeypointContract, FindsNoCornerOnAPlane) {
  if (GetParam().method == "uniform") GTEST_SKIP() << "takes points of any shape";
  test::OwnedSurface plane(2500, 0);
  plane->size = 2500;
  plane->spacing_m = 0.01;
  for (std::size_t i = 0; i < 2500; ++i) {
    plane->x[i] = 0.01F * static_cast<float>(i % 50);
    plane->y[i] = 0.01F * static_cast<float>(i / 50);
    plane->z[i] = 1.0F;
    plane->nz[i] = -1.0F;
    plane->intensity[i] = 0.5F;
  }
  Detection d = make();
  ASSERT_TRUE(d.detector->detect(*plane, d.keypoints).ok());
  if (GetParam().method != "narf") {
    EXPECT_TRUE(d.keypoints.empty());
    return;
  }
  // NARF looks at outlines: nothing inside the sheet's support of them.
  for (const Keypoint& keypoint : d.keypoints) {
    const Vec3f p = plane->point(static_cast<std::size_t>(keypoint.point));
    const float edge = std::min({p.x(), p.y(), 0.49F - p.x(), 0.49F - p.y()});
    EXPECT_LT(edge, 0.15F);
  }
}

TEST_P(KeypointContract, RefusesAnEmptySurfaceAndOneOverCapacity) {
  Detection d = make();
  test::OwnedSurface empty(4, 0);
  empty->spacing_m = 0.01;
  const Status none = d.detector->detect(*empty, d.keypoints);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().code, Code::TooFewPoints);
  EXPECT_EQ(none.error().stage, Stage::Keypoints);
  test::OwnedSurface large = test::random_cloud(limits().max_points + 1, 1.0, 3);
  large->spacing_m = 0.02;
  std::fill(large->intensity.begin(), large->intensity.end(), 0.5F);
  const Status over = d.detector->detect(*large, d.keypoints);
  ASSERT_FALSE(over.ok());
  EXPECT_EQ(over.error().code, Code::CapacityExceeded);
  EXPECT_EQ(over.error().stage, Stage::Keypoints);
}

TEST_P(KeypointContract, KeepsTheStrongestThatFitAndSaysSo) {
  test::OwnedSurface surface = ball();
  Detection all = make();
  Detection few = make(3);
  ASSERT_TRUE(all.detector->detect(*surface, all.keypoints).ok());
  ASSERT_TRUE(few.detector->detect(*surface, few.keypoints).ok());
  ASSERT_GT(all.keypoints.size(), 3U);
  EXPECT_LE(few.keypoints.size(), 3U);
  EXPECT_TRUE(few.keypoints.overflowed());
  std::vector<float> scores;
  for (const Keypoint& keypoint : all.keypoints) scores.push_back(keypoint.score);
  std::sort(scores.rbegin(), scores.rend());
  for (const Keypoint& keypoint : few.keypoints) EXPECT_GE(keypoint.score, scores[2]);
}

TEST_P(KeypointContract, DoesNotTouchTheHeap) {
  if (!test::heap_guard_works()) GTEST_SKIP() << test::kNoHeapGuard;
  test::OwnedSurface closed = ball();
  test::OwnedSurface view = grid();
  Detection d = make();
  test::arm_heap_guard();
  const bool first = d.detector->detect(*closed, d.keypoints).ok();
  const bool second = d.detector->detect(*view, d.keypoints).ok();
  test::disarm_heap_guard();
  EXPECT_TRUE(first && second);
  EXPECT_EQ(test::heap_calls(), 0U) << test::first_heap_call();
}

}  // namespace
}  // namespace grapnel
