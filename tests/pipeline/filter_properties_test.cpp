// What every filter of the registry must be: bound to no unit and no order of the points, and to no
// frame where its definition names no axes.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "base/config.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/registry.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

constexpr std::size_t kPoints = 1500;

template <std::size_t kCount>
bool is_one_of(const std::string& name, const std::array<const char*, kCount>& list) {
  return std::any_of(list.begin(), list.end(), [&](const char* other) { return name == other; });
}

class FilterProperties : public testing::TestWithParam<std::size_t> {
 protected:
  FilterProperties() {
    PcaNormals normals({});
    const test::ArenaMemory memory(
        [&](Arena& arena) { normals.reserve(arena, test::small_limits()); });
    EXPECT_TRUE(normals.estimate(*still_).ok());
    EXPECT_TRUE(normals.estimate(*changed_).ok());
  }
  static std::string name() { return std::string(cloud_filters()[GetParam()].name); }
  /// Keys that make a filter do something to this cloud; lengths by `scale`.
  static std::vector<std::string> keys(double scale) {
    const std::string leaf = std::to_string(0.04 * scale);
    if (name() == "voxel") return {"leaf_m=" + leaf};
    if (name() == "voxel_covariance") return {"leaf_m=" + leaf, "min_points=3"};
    if (name() == "crop") return {"max_x_m=" + std::to_string(0.05 * scale)};
    if (name() == "normal_space" || name() == "random_sample" || name() == "covariance_sampling") {
      return {"points=300"};
    }
    return {};
  }
  /// False where the filter refuses the cloud, which it then does every time.
  static bool apply(Surface& surface, double scale = 1.0) {
    ConfigTable table("", name(), 0);
    for (const std::string& key : keys(scale)) apply_override(table, key);
    ConfigReader reader(table);
    const std::unique_ptr<CloudFilter> filter = cloud_filters()[GetParam()].make(reader);
    const test::ArenaMemory memory(
        [&](Arena& arena) { filter->reserve(arena, test::small_limits()); });
    return filter->apply(surface).ok();
  }
  /// That hardly a point of one is missing in the other; `back` brings the second onto the first.
  void expect_same_points(const Pose& back, double scale) {
    ASSERT_GT(still_->size, 0U);
    const auto missing = [](const std::vector<Vec3d>& these, const std::vector<Vec3d>& those) {
      return std::count_if(these.begin(), these.end(), [&](const Vec3d& p) {
        return std::none_of(those.begin(), those.end(),
                            [&](const Vec3d& q) { return (p - q).norm() < 1e-5; });
      });
    };
    std::vector<Vec3d> before;
    std::vector<Vec3d> after;
    for (std::size_t i = 0; i < still_->size; ++i) {
      before.push_back(still_->point(i).cast<double>());
    }
    for (std::size_t i = 0; i < changed_->size; ++i) {
      after.push_back(back * (changed_->point(i).cast<double>() / scale));
    }
    // A neighbour on a sphere's rim or a cell's border may fall to either side by rounding.
    EXPECT_LE(50 * missing(before, after), static_cast<std::ptrdiff_t>(before.size()));
    EXPECT_LE(50 * missing(after, before), static_cast<std::ptrdiff_t>(after.size()));
  }

  test::OwnedSurface still_ = test::bumpy_ball(kPoints, 0.2);
  test::OwnedSurface changed_ = test::bumpy_ball(kPoints, 0.2);
};

constexpr const char* kRefused = "takes surfaces of a camera's grid only";

TEST_P(FilterProperties, FollowsAMotion) {
  if (is_one_of(name(), std::array{"voxel", "voxel_covariance", "uniform_sample", "crop",
                                   "normal_space", "z_median"})) {
    GTEST_SKIP() << "bound to the axes by definition";
  }
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3d(0.4, -0.9, 1.2));
  pose.translation() = Vec3d(0.3, 0.2, -0.5);
  test::move(*changed_, pose);
  const bool taken = apply(*still_);
  ASSERT_EQ(apply(*changed_), taken);
  if (!taken) GTEST_SKIP() << kRefused;
  expect_same_points(pose.inverse(), 1.0);
}

TEST_P(FilterProperties, DoesNotDependOnTheOrderOfThePoints) {
  if (is_one_of(name(), std::array{"random_sample", "normal_space"})) {
    GTEST_SKIP() << "draws points by their number";
  }
  const auto n = static_cast<std::ptrdiff_t>(kPoints);
  for (std::span<float> Surface::*plane :
       {&Surface::x, &Surface::y, &Surface::z, &Surface::nx, &Surface::ny, &Surface::nz}) {
    std::reverse(((*changed_).*plane).begin(), ((*changed_).*plane).begin() + n);
  }
  const bool taken = apply(*still_);
  ASSERT_EQ(apply(*changed_), taken);
  if (!taken) GTEST_SKIP() << kRefused;
  expect_same_points(Pose::Identity(), 1.0);
}

TEST_P(FilterProperties, FollowsAScaleOfTwo) {
  for (std::size_t i = 0; i < kPoints; ++i) {
    changed_->x[i] *= 2.0F;
    changed_->y[i] *= 2.0F;
    changed_->z[i] *= 2.0F;
  }
  changed_->spacing_m *= 2.0;
  changed_->viewpoint *= 2.0F;
  const bool taken = apply(*still_);
  ASSERT_EQ(apply(*changed_, 2.0), taken);
  if (!taken) GTEST_SKIP() << kRefused;
  expect_same_points(Pose::Identity(), 2.0);
}

INSTANTIATE_TEST_SUITE_P(OfTheRegistry, FilterProperties,
                         testing::Range<std::size_t>(0, cloud_filters().size()),
                         [](const auto& filter) {
                           return std::string(cloud_filters()[filter.param].name);
                         });

}  // namespace
}  // namespace grapnel
