#include <vector>

#include "pipeline/preprocess/median.h"
#include "pipeline/preprocess/organize.h"
#include "pipeline/preprocess/statistical_outliers.h"
#include "pipeline/preprocess/voxel.h"
#include "tests/bench/groups.h"
#include "tests/bench/inputs.h"
#include "tests/bench/peers/open3d.h"
#include "tests/bench/peers/peers.h"
#include "tests/bench/table.h"

namespace grapnel::bench {
namespace {

constexpr int kRuns = 9;
constexpr double kLeaf_m = 0.005;
/// Of Open3D's normals, which know no grid.
constexpr double kNormalRadius_m = 0.015;
constexpr int kNormalNeighbours = 30;

struct Filters {
  test::TestFrame frame = make_frame();
  test::OwnedSurface surface{kPixels, kPixels};
  Held<CloudFilter> outliers{std::make_unique<StatisticalOutliers>(StatisticalOutlierParams{})};
  Held<CloudFilter> voxel{std::make_unique<VoxelGrid>(VoxelParams{kLeaf_m, 6000})};
  Held<NormalEstimator> plane{make(find_method(normal_estimators(), "grid_plane"))};
  Held<NormalEstimator> pca{make(find_method(normal_estimators(), "pca"))};
};

}  // namespace

void print_filters() {
  Filters f;
  DepthMedian median({});
  WorkingDepth work;
  const test::ArenaMemory memory([&](Arena& arena) {
    median.reserve(arena, Limits{});
    work.reserve(arena, Limits{});
  });
  const auto whole = [&f] { fill(f.frame, 1, *f.surface); };
  whole();
  using peers::GridNormals;
  const auto theirs = [&](GridNormals method) { return peers::grid_normals(*f.surface, method); };
  const auto plane = [&f] { require(f.plane.stage->estimate(*f.surface).ok(), "normals"); };
  std::vector<Row> rows;
  rows.push_back({"normals, full frame, plane of inverse depths (`grid_plane`); PCL: depth change",
                  4.0, 1.0, whole, plane, theirs(GridNormals::DepthChange)});
  rows.push_back(
      {"the same; PCL: gradient", 4.0, 1.0, whole, plane, theirs(GridNormals::Gradient)});
  rows.push_back(
      {"normals, full frame, points in a sphere (`pca`); PCL: covariance; Open3D: 15 mm, 30 points",
       0.0, 0.0, whole, [&f] { require(f.pca.stage->estimate(*f.surface).ok(), "normals"); },
       theirs(GridNormals::Covariance),
       peers::o3d::normals(*f.surface, kNormalRadius_m, kNormalNeighbours)});
  rows.push_back({"5 × 5 median, full frame", 1.5, 0.6,
                  [&] { require(organize(f.frame.frame, {}, work).ok(), "organize"); },
                  [&] { median.apply(work); }, peers::median_5x5(*f.surface)});
  rows.push_back({"statistical outliers, k = 20, 306k points", 60.0, 20.0, whole,
                  [&f] { require(f.outliers.stage->apply(*f.surface).ok(), "outliers"); },
                  peers::statistical_outliers(*f.surface, 20, 1.0),
                  peers::o3d::statistical_outliers(*f.surface, 20, 1.0)});
  rows.push_back({"voxels of 5 mm, 306k points", 6.0, 2.0, whole,
                  [&f] { require(f.voxel.stage->apply(*f.surface).ok(), "voxels"); },
                  peers::voxels(*f.surface, kLeaf_m), peers::o3d::voxels(*f.surface, kLeaf_m)});
  print_rows(rows, kRuns);
}

}  // namespace grapnel::bench
