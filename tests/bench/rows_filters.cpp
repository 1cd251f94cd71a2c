#include <cstdio>
#include <vector>

#include "pipeline/preprocess/median.h"
#include "pipeline/preprocess/organize.h"
#include "pipeline/preprocess/statistical_outliers.h"
#include "pipeline/preprocess/voxel.h"
#include "tests/bench/groups.h"
#include "tests/bench/inputs.h"
#include "tests/bench/peers/peers.h"
#include "tests/bench/table.h"

namespace grapnel::bench {
namespace {

constexpr int kRuns = 9;
constexpr double kLeaf_m = 0.005;

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
  rows.push_back({"normals, full frame, points in a sphere (`pca`); PCL: covariance", 0.0, 0.0,
                  whole, [&f] { require(f.pca.stage->estimate(*f.surface).ok(), "normals"); },
                  theirs(GridNormals::Covariance)});
  rows.push_back({"5 × 5 median, full frame", 1.5, 0.6,
                  [&] { require(organize(f.frame.frame, {}, work).ok(), "organize"); },
                  [&] { median.apply(work); }, peers::median_5x5(*f.surface)});
  rows.push_back({"statistical outliers, k = 20, 306k points", 60.0, 20.0, whole,
                  [&f] { require(f.outliers.stage->apply(*f.surface).ok(), "outliers"); },
                  peers::statistical_outliers(*f.surface, 20, 1.0)});
  rows.push_back({"voxels of 5 mm, 306k points", 6.0, 2.0, whole,
                  [&f] { require(f.voxel.stage->apply(*f.surface).ok(), "voxels"); },
                  peers::voxels(*f.surface, kLeaf_m)});
  print_rows(rows, kRuns);
}

void print_growth() {
  Filters f;
  std::printf("| points | statistical outliers, ms | voxels of 5 mm, ms | normals, ms |\n");
  std::printf("|---|---|---|---|\n");
  for (const int stride : {8, 4, 2, 1}) {
    const auto again = [&f, stride] { fill(f.frame, stride, *f.surface); };
    again();
    const std::size_t points = f.surface->size;
    const auto median_of = [&](const std::function<void()>& run) {
      return median_ms({"", 0, 0, again, run}, 5);
    };
    const double outliers = median_of([&] { (void)f.outliers.stage->apply(*f.surface); });
    const double voxels = median_of([&] { (void)f.voxel.stage->apply(*f.surface); });
    const double normals = median_of([&] { (void)f.plane.stage->estimate(*f.surface); });
    std::printf("| %zu | %.2f | %.2f | %.2f |\n", points, outliers, voxels, normals);
  }
  std::printf("\n");
}

}  // namespace grapnel::bench
