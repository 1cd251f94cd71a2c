#include "pipeline/refine/icp.h"

#include <gtest/gtest.h>

#include "pipeline/refine/closest_point_table.h"
#include "tests/pipeline/support/box_scene.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

Pose small_motion() {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3d(0.05, -0.08, 0.06));
  pose.translation() = Vec3d(0.008, -0.006, 0.005);
  return pose;
}

/// Counts how often partners are looked for, and how.
class Counted final : public ClosestSurface {
 public:
  explicit Counted(const ClosestPointTable& table) : table_(table) {}
  [[nodiscard]] std::int32_t closest(const Vec3f& p, float max_distance_m) const noexcept override {
    return table_.closest(p, max_distance_m);
  }
  void closest_of_each(const float* x, const float* y, const float* z, std::size_t count,
                       float max_distance_m, std::int32_t* found) const noexcept override {
    nearest += count;
    table_.closest_of_each(x, y, z, count, max_distance_m, found);
  }
  void nearby_of_each(const float* x, const float* y, const float* z, std::size_t count,
                      float max_distance_m, std::int32_t* found) const noexcept override {
    EXPECT_EQ(nearest, 0U);
    nearby += count;
    table_.nearby_of_each(x, y, z, count, max_distance_m, found);
  }

  mutable std::size_t nearest = 0;
  mutable std::size_t nearby = 0;

 private:
  const ClosestPointTable& table_;
};

class IcpOnABox : public testing::Test {
 protected:
  IcpOnABox()
      : fixed_(test::surface_of(test::box_cloud(Vec3d(0.4, 0.3, 0.2), 0.005))),
        moving_(test::surface_of(test::box_cloud(Vec3d(0.4, 0.3, 0.2), 0.011))),
        memory_([&](Arena& arena) { table_.reserve(arena, 500000); }) {
    fixed_->spacing_m = 0.01;
    table_.build(*fixed_, 0.05);
  }
  RefinedPose refine(const IcpParams& params, const Pose& start) {
    Icp icp(params);
    const Result<RefinedPose> result = icp.refine(*moving_, *fixed_, table_, start);
    EXPECT_TRUE(result.ok());
    return result.ok() ? result.value() : RefinedPose{};
  }

  test::OwnedSurface fixed_;
  test::OwnedSurface moving_;
  ClosestPointTable table_;
  test::ArenaMemory memory_;
};

TEST_F(IcpOnABox, PointToPlaneReturnsToTheTruth) {
  IcpParams params;
  params.max_iterations = 60;
  const RefinedPose found = refine(params, small_motion());
  EXPECT_TRUE(found.converged);
  // Planes against planes: exact but for single precision and wrong partners at the edges.
  EXPECT_LT((found.target_from_source.translation()).norm(), 1e-4);
  EXPECT_LT(rotation_angle_rad(found.target_from_source, Pose::Identity()), 5e-4);
  EXPECT_LT(found.rmse_m, 1e-4);
}

TEST_F(IcpOnABox, LooksForTheNearestOnceTheDistanceLimitHasSettledAndAtTheEnd) {
  const Counted counted(table_);
  IcpParams params;
  params.max_points = 100000;
  params.anneal_iterations = 8;
  params.max_iterations = 20;
  ASSERT_TRUE(Icp(params).refine(*moving_, *fixed_, counted, small_motion()).ok());
  EXPECT_EQ(counted.nearby, 8 * moving_->size);
  EXPECT_GE(counted.nearest, moving_->size);
  const Counted short_of(table_);
  params.max_iterations = 5;
  ASSERT_TRUE(Icp(params).refine(*moving_, *fixed_, short_of, small_motion()).ok());
  EXPECT_EQ(short_of.nearest, moving_->size);
}

TEST_F(IcpOnABox, PointToPointReturnsToTheTruthWithinTheSampling) {
  IcpParams params;
  params.metric = IcpParams::Metric::PointToPoint;
  params.max_iterations = 200;
  const RefinedPose found = refine(params, small_motion());
  EXPECT_LT((found.target_from_source.translation()).norm(), 2e-3);
  EXPECT_LT(rotation_angle_rad(found.target_from_source, Pose::Identity()), 1e-2);
}

TEST_F(IcpOnABox, ARigidMotionOfBothMovesTheAnswerAlong) {
  Pose far = Pose::Identity();
  far.linear() = rotation_from_vector(Vec3d(1.0, 2.0, 0.5));
  far.translation() = Vec3d(5.0, -3.0, 2.0);
  IcpParams params;
  params.max_iterations = 60;
  test::move(*moving_, far);
  const RefinedPose found = refine(params, small_motion() * far.inverse());
  const Pose back = found.target_from_source * far;
  EXPECT_LT(back.translation().norm(), 2e-4);
  EXPECT_LT(rotation_angle_rad(back, Pose::Identity()), 5e-4);
}

TEST_F(IcpOnABox, SaysWhenItLostItsPartners) {
  Pose away = Pose::Identity();
  away.translation() = Vec3d(3.0, 0.0, 0.0);
  Icp icp({});
  const Result<RefinedPose> result = icp.refine(*moving_, *fixed_, table_, away);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, Code::RefinementDiverged);
}

TEST(IcpOnAPlane, LeavesWhatThePlaneDoesNotFix) {
  test::OwnedSurface plane = test::surface_of([] {
    CloudData cloud = test::box_cloud(Vec3d(1.0, 1.0, 0.02), 0.02);
    CloudData top;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (cloud.nz[i] < 0.5F) continue;
      top.x.push_back(cloud.x[i]);
      top.y.push_back(cloud.y[i]);
      top.z.push_back(cloud.z[i]);
      top.nx.push_back(cloud.nx[i]);
      top.ny.push_back(cloud.ny[i]);
      top.nz.push_back(cloud.nz[i]);
    }
    top.width = static_cast<int>(top.size());
    return top;
  }());
  plane->spacing_m = 0.02;
  ClosestPointTable table;
  const test::ArenaMemory memory([&](Arena& arena) { table.reserve(arena, 200000); });
  table.build(*plane, 0.2);
  Pose start = Pose::Identity();
  start.linear() = rotation_from_vector(Vec3d(0.02, 0.0, 0.1));
  start.translation() = Vec3d(0.05, 0.03, 0.02);
  Icp icp({});
  const Result<RefinedPose> result = icp.refine(*plane, *plane, table, start);
  ASSERT_TRUE(result.ok());
  const Pose& found = result.value().target_from_source;
  EXPECT_NEAR((found * Vec3d(0.0, 0.0, 0.01)).z(), 0.01, 1e-4);
  EXPECT_NEAR(found.linear()(2, 2), 1.0, 1e-6);
  EXPECT_NEAR(found.translation().x(), 0.05, 2e-3);
  EXPECT_NEAR(found.translation().y(), 0.03, 2e-3);
}

}  // namespace
}  // namespace grapnel
