// The ways to find closest points, held to a foreign k-d tree (nanoflann), and registration with
// each of them to registration with the tree.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nanoflann.hpp>
#include <utility>
#include <vector>

#include "base/cloud_file.h"
#include "base/rng.h"
#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/refine/closest_in_cells.h"
#include "pipeline/refine/closest_point_table.h"
#include "pipeline/refine/icp.h"
#include "pipeline/refine/plain_icp.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

/// A surface as nanoflann asks for it.
struct TreePoints {
  const Surface* surface = nullptr;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return surface->size; }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return surface->point(i)[static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, TreePoints>,
                                                 TreePoints, 3, std::uint32_t>;

class ClosestInTree final : public ClosestSurface {
 public:
  explicit ClosestInTree(const Surface& surface)
      : points_{&surface}, tree_(3, points_, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {
    tree_.buildIndex();
  }
  [[nodiscard]] std::int32_t closest(const Vec3f& p, float max_distance_m) const noexcept override {
    std::uint32_t index = 0;
    float squared_m2 = 0.0F;
    const float place[3] = {p.x(), p.y(), p.z()};
    if (tree_.knnSearch(place, 1, &index, &squared_m2) == 0) return -1;
    return squared_m2 <= max_distance_m * max_distance_m ? static_cast<std::int32_t>(index) : -1;
  }

 private:
  TreePoints points_;
  Tree tree_;
};

class AgainstTree : public testing::Test {
 protected:
  AgainstTree() {
    PcaNormals normals({});
    const test::ArenaMemory scratch(
        [&](Arena& arena) { normals.reserve(arena, test::small_limits()); });
    for (Surface* surface : {&*fixed_, &*moving_}) EXPECT_TRUE(normals.estimate(*surface).ok());
    EXPECT_TRUE(cells_.build(*fixed_, fixed_->spacing_m).ok());
    table_.build(*fixed_, 0.06);
  }

  /// A start within the basin: some spacings off.
  static Pose start(Rng& rng) {
    Pose pose = Pose::Identity();
    pose.linear() = rotation_from_vector(
        0.05 * Vec3d(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)));
    pose.translation() =
        0.01 * Vec3d(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0));
    return pose;
  }

  test::OwnedSurface fixed_ = test::bumpy_ball(2000, 0.2);
  test::OwnedSurface moving_ = test::bumpy_ball(700, 0.2);
  ClosestInCells cells_;
  ClosestPointTable table_;
  test::ArenaMemory memory_{[this](Arena& arena) {
    cells_.reserve(arena, 2000);
    table_.reserve(arena, 500000);
  }};
};

TEST_F(AgainstTree, CellsFindTheSamePoints) {
  const ClosestInTree tree(*fixed_);
  Rng rng(5);
  for (int i = 0; i < 3000; ++i) {
    const Vec3f p(static_cast<float>(rng.uniform(-0.3, 0.3)),
                  static_cast<float>(rng.uniform(-0.3, 0.3)),
                  static_cast<float>(rng.uniform(-0.3, 0.3)));
    const float reach_m = static_cast<float>(rng.uniform(0.0, 0.2));
    const std::int32_t found = cells_.closest(p, reach_m);
    const std::int32_t expected = tree.closest(p, reach_m);
    ASSERT_EQ(found < 0, expected < 0) << i;
    if (found < 0) continue;
    // Two points may be equally near.
    ASSERT_EQ((fixed_->point(static_cast<std::size_t>(found)) - p).squaredNorm(),
              (fixed_->point(static_cast<std::size_t>(expected)) - p).squaredNorm())
        << i;
  }
}

TEST_F(AgainstTree, PlainRegistrationEndsAtTheSamePose) {
  const ClosestInTree tree(*fixed_);
  Rng rng(6);
  PlainIcpParams params;
  params.metric = PlainIcpParams::Metric::PointToPlane;
  for (int i = 0; i < 20; ++i) {
    const Pose from = start(rng);
    const auto a = PlainIcp(params).refine(*moving_, *fixed_, cells_, from);
    const auto b = PlainIcp(params).refine(*moving_, *fixed_, tree, from);
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_LT((a.value().target_from_source.matrix() - b.value().target_from_source.matrix())
                  .cwiseAbs()
                  .maxCoeff(),
              1e-9)
        << i;
  }
}

TEST_F(AgainstTree, RegistrationByTheModelsTableEndsWithinItsVoxels) {
  const ClosestInTree tree(*fixed_);
  Rng rng(7);
  for (int i = 0; i < 200; ++i) {
    const Pose from = start(rng);
    const auto a = Icp(IcpParams{}).refine(*moving_, *fixed_, table_, from);
    const auto b = Icp(IcpParams{}).refine(*moving_, *fixed_, tree, from);
    ASSERT_TRUE(a.ok() && b.ok());
    // The table's candidates are nearest to a voxel's corner, not to the point: point to plane
    // forgives a neighbour on the same plane. 0.05 mm and 0.02°.
    EXPECT_LT(
        (a.value().target_from_source.translation() - b.value().target_from_source.translation())
            .norm(),
        5e-5)
        << i;
    EXPECT_LT(rotation_angle_rad(a.value().target_from_source, b.value().target_from_source),
              3.5e-4)
        << i;
  }
}

/// Spheres around every `step`-th point: the same points by the surface's own search.
void expect_the_trees_spheres(Surface& surface, float radius_m, std::size_t step) {
  Limits limits = test::small_limits();
  limits.max_points = limits.max_input_points = limits.max_model_points = surface.size;
  limits.max_width = std::max(limits.max_width, surface.grid.width);
  limits.max_height = std::max(limits.max_height, surface.grid.height);
  NeighbourSearch search;
  const test::ArenaMemory memory([&](Arena& arena) { search.reserve(arena, limits); });
  ASSERT_TRUE(search.build(surface, static_cast<double>(radius_m)).ok());
  const TreePoints points{&surface};
  Tree tree(3, points, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  tree.buildIndex();
  std::vector<std::pair<std::uint32_t, float>> theirs;
  for (std::size_t i = 0; i < surface.size; i += step) {
    const Neighbourhood ours = search.within(i, radius_m);
    const float place[3] = {surface.x[i], surface.y[i], surface.z[i]};
    const float square_m2 = radius_m * radius_m;
    // What lies on the sphere itself counts here, not there; hardly a point does.
    (void)tree.radiusSearch(place, std::nextafter(square_m2, 1.0F), theirs, {});
    std::vector<std::int32_t> found(ours.index.begin(), ours.index.end());
    std::vector<std::int32_t> expected;
    for (const auto& item : theirs) expected.push_back(static_cast<std::int32_t>(item.first));
    std::sort(found.begin(), found.end());
    std::sort(expected.begin(), expected.end());
    ASSERT_EQ(found, expected) << i;
  }
}

// PCL: test/search/test_search.cpp and test_organized_index.cpp hold each search to brute force on
// a cloud and on a camera's frame.
TEST(NeighboursOfRecordedClouds, AreTheTreesOnACloud) {
  const auto file = test::recorded_data("pcl_test/bun0.pcd");
  if (file.empty()) GTEST_SKIP() << test::kNoRecordedData;
  test::OwnedSurface bunny = test::surface_of(read_cloud(file));
  for (const float radius_m : {0.005F, 0.0171F, 0.06F})
    expect_the_trees_spheres(*bunny, radius_m, 1);
}

TEST(NeighboursOfRecordedClouds, AreTheTreesOnACamerasFrame) {
  const auto file = test::recorded_data("pcl_test/milk_cartoon_all_small_clorox.pcd");
  if (file.empty()) GTEST_SKIP() << test::kNoRecordedData;
  const Intrinsics camera = {640, 480, 525.0, 525.0, 319.5, 239.5};
  test::OwnedSurface frame = test::grid_surface_of(read_cloud(file), camera);
  expect_the_trees_spheres(*frame, 0.0113F, 97);
}

}  // namespace
}  // namespace grapnel
