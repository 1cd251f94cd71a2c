// Prints what every stage takes, on one synthetic frame of 640 × 480, beside what it must take.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "base/config.h"
#include "base/rng.h"
#include "pipeline/coarse/generators.h"
#include "pipeline/preprocess/grid_stride.h"
#include "pipeline/preprocess/median.h"
#include "pipeline/preprocess/organize.h"
#include "pipeline/preprocess/statistical_outliers.h"
#include "pipeline/preprocess/voxel.h"
#include "pipeline/refine/closest_in_cells.h"
#include "pipeline/refine/closest_point_table.h"
#include "pipeline/refine/icp.h"
#include "pipeline/registry.h"
#include "tests/bench/table.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel::bench {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr int kRuns = 9;
constexpr std::size_t kPixels = static_cast<std::size_t>(kWidth) * kHeight;

/// A tilted table with a bumpy part on it, 0.7 to 1.3 m away; noise of a Kinect, 0.3 % not read.
test::TestFrame make_frame() {
  test::TestFrame frame(kWidth, kHeight, 525.0);
  frame.draw_plane(Vec3d(0.0, -0.5, -1.0).normalized(), 1.0, 0, 0, kWidth, kHeight);
  Rng rng(1);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      std::uint16_t& count = frame.at(u, v);
      const double z_m = 0.001 * count;
      double part = 0.0;
      if (u >= 200 && u < 440 && v >= 120 && v < 360) {
        part = 60.0 + 25.0 * std::sin(0.07 * u) * std::cos(0.05 * v + 0.02 * u);
      }
      const double noise = 1.425 * z_m * z_m * rng.normal();
      count = rng.uniform() < 0.003 ? std::uint16_t{0}
                                    : static_cast<std::uint16_t>(count - part + noise + 0.5);
    }
  }
  return frame;
}

/// Every `stride`-th pixel of the frame as an organised surface.
void fill(const test::TestFrame& frame, int stride, Surface& surface) {
  const Intrinsics& k = frame.frame.intrinsics;
  surface.clear();
  surface.grid.width = kWidth / stride;
  surface.grid.height = kHeight / stride;
  surface.grid.intrinsics = k;
  Intrinsics& grid = surface.grid.intrinsics;
  grid.width = surface.grid.width;
  grid.height = surface.grid.height;
  grid.fx /= stride;
  grid.fy /= stride;
  grid.cx /= stride;
  grid.cy /= stride;
  surface.has_viewpoint = true;
  surface.viewpoint = Vec3f::Zero();
  surface.spacing_m = 0.0019 * stride;
  std::size_t pixel = 0;
  for (int v = 0; v < grid.height; ++v) {
    for (int u = 0; u < grid.width; ++u, ++pixel) {
      const std::uint16_t count = frame.frame.depth.at(u * stride, v * stride);
      surface.grid.point_of[pixel] = -1;
      if (count == 0) continue;
      const std::size_t i = surface.size++;
      const double z = 0.001 * count;
      surface.x[i] = static_cast<float>(z * (u - grid.cx) / grid.fx);
      surface.y[i] = static_cast<float>(z * (v - grid.cy) / grid.fy);
      surface.z[i] = static_cast<float>(z);
      surface.nx[i] = surface.ny[i] = surface.nz[i] = surface.intensity[i] = 0.0F;
      surface.grid.pixel_of[i] = static_cast<std::int32_t>(pixel);
      surface.grid.point_of[pixel] = static_cast<std::int32_t>(i);
    }
  }
}

template <class StageKind>
std::unique_ptr<StageKind> make(const Method<StageKind>& method, const std::string& settings = "") {
  ConfigTable table("", std::string(method.name), 0);
  if (!settings.empty()) apply_override(table, settings);
  ConfigReader reader(table);
  return method.make(reader);
}

Limits large() {
  Limits limits;
  limits.max_points = limits.max_input_points = kPixels;
  limits.max_keypoints = kPixels / 8;
  return limits;
}

template <class Stage>
struct Held {
  std::unique_ptr<Stage> stage;
  test::ArenaMemory memory;
  explicit Held(std::unique_ptr<Stage> made)
      : stage(std::move(made)), memory([this](Arena& arena) { stage->reserve(arena, large()); }) {}
};

void require(bool ok, const char* what) {
  if (ok) return;
  std::fprintf(stderr, "%s failed\n", what);
  std::exit(1);
}

/// Where a table, a search or a working copy of the frame lives.
struct Bench {
  test::TestFrame frame = make_frame();
  test::OwnedSurface surface{kPixels, kPixels};

  void print_filters() {
    Held<CloudFilter> outliers(std::make_unique<StatisticalOutliers>(StatisticalOutlierParams{}));
    Held<CloudFilter> voxel(std::make_unique<VoxelGrid>(VoxelParams{0.005, 6000}));
    Held<NormalEstimator> plane(make(find_method(normal_estimators(), "grid_plane")));
    DepthMedian median({});
    WorkingDepth work;
    const test::ArenaMemory memory([&](Arena& arena) {
      median.reserve(arena, Limits{});
      work.reserve(arena, Limits{});
    });
    const auto whole = [this] { fill(frame, 1, *surface); };
    std::vector<Row> rows;
    rows.push_back({"normals of the full frame (grid_plane)", 4.0, 1.0, whole,
                    [&] { require(plane.stage->estimate(*surface).ok(), "normals"); }});
    rows.push_back({"5 × 5 median, full frame", 1.5, 0.6,
                    [&] { require(organize(frame.frame, {}, work).ok(), "organize"); },
                    [&] { median.apply(work); }});
    rows.push_back({"statistical outliers, k = 20, 306k points", 60.0, 20.0, whole,
                    [&] { require(outliers.stage->apply(*surface).ok(), "outliers"); }});
    rows.push_back({"voxels of 5 mm, 306k points", 6.0, 2.0, whole,
                    [&] { require(voxel.stage->apply(*surface).ok(), "voxel"); }});
    print_rows(rows, kRuns);
    print_growth(*outliers.stage, *voxel.stage, *plane.stage);
  }

  void print_growth(CloudFilter& outliers, CloudFilter& voxel, NormalEstimator& plane) {
    std::printf("| points | statistical outliers, ms | voxels of 5 mm, ms | normals, ms |\n");
    std::printf("|---|---|---|---|\n");
    for (const int stride : {8, 4, 2, 1}) {
      const auto again = [this, stride] { fill(frame, stride, *surface); };
      again();
      const std::size_t points = surface->size;
      const double a = median_ms({"", 0, 0, again, [&] { (void)outliers.apply(*surface); }}, 5);
      const double b = median_ms({"", 0, 0, again, [&] { (void)voxel.apply(*surface); }}, 5);
      const double c = median_ms({"", 0, 0, again, [&] { (void)plane.estimate(*surface); }}, 5);
      std::printf("| %zu | %.2f | %.2f | %.2f |\n", points, a, b, c);
    }
    std::printf("\n");
  }

  void print_keypoints() {
    Held<NormalEstimator> normals(make(find_method(normal_estimators(), "pca")));
    Held<CloudFilter> thin(std::make_unique<VoxelGrid>(VoxelParams{0.01, 6000}));
    fill(frame, 1, *surface);
    require(thin.stage->apply(*surface).ok(), "voxel");
    require(normals.stage->estimate(*surface).ok(), "normals");
    std::printf("Detectors with their defaults, %zu unorganised points at 10 mm:\n\n",
                surface->size);
    std::vector<std::unique_ptr<Held<KeypointDetector>>> held;
    std::vector<Keypoint> storage(large().max_keypoints);
    KeypointSet found{std::span<Keypoint>(storage)};
    std::vector<Row> rows;
    for (const Method<KeypointDetector>& method : keypoint_detectors()) {
      held.push_back(std::make_unique<Held<KeypointDetector>>(make(method)));
      KeypointDetector* detector = held.back()->stage.get();
      found.clear();
      // Some need a grid or intensities.
      if (!detector->detect(*surface, found).ok()) continue;
      rows.push_back({"keypoints: " + std::string(method.name), 0, 0, [&] { found.clear(); },
                      [&, detector] { (void)detector->detect(*surface, found); }});
    }
    print_rows(rows, 5);
  }

  void print_registration() {
    test::OwnedSurface fixed = test::bumpy_ball(20000, 0.2);
    test::OwnedSurface moving = test::bumpy_ball(5000, 0.2);
    Held<NormalEstimator> normals(make(find_method(normal_estimators(), "pca")));
    for (Surface* surface_of : {&*fixed, &*moving}) {
      require(normals.stage->estimate(*surface_of).ok(), "normals");
    }
    ClosestPointTable table;
    ClosestInCells cells;
    const test::ArenaMemory memory([&](Arena& arena) {
      table.reserve(arena, 1000000);
      cells.reserve(arena, 20000);
    });
    table.build(*fixed, 0.03);
    Pose start = Pose::Identity();
    start.linear() = rotation_from_vector(Vec3d(0.02, -0.03, 0.02));
    start.translation() = Vec3d(0.002, -0.003, 0.002);
    IcpParams params;
    params.max_iterations = 20;
    params.max_points = 5000;
    params.convergence_m = params.convergence_rad = 0.0;
    Icp icp(params);
    std::vector<Row> rows;
    rows.push_back({"ICP point to plane, 20 iterations, 5k on 20k, model table (8 voxels a point)",
                    3.0,
                    1.0,
                    {},
                    [&] { require(icp.refine(*moving, *fixed, table, start).ok(), "icp"); }});
    const OneLook quick(table);
    rows.push_back({"the same, one voxel a point (as of coarse poses)", 3.0, 1.0, {}, [&] {
                      require(icp.refine(*moving, *fixed, quick, start).ok(), "icp");
                    }});
    rows.push_back({"the same, two unorganised clouds, nothing built before", 20.0, 8.0, {}, [&] {
                      require(cells.build(*fixed, fixed->spacing_m).ok(), "cells");
                      require(icp.refine(*moving, *fixed, cells, start).ok(), "icp");
                    }});
    print_rows(rows, kRuns);
  }

 private:
  class OneLook final : public ClosestSurface {
   public:
    explicit OneLook(const ClosestPointTable& table) : table_(table) {}
    [[nodiscard]] std::int32_t closest(const Vec3f& p, float) const noexcept override {
      return table_.nearby(p);
    }
    void closest_of_each(const float* x, const float* y, const float* z, std::size_t count, float,
                         std::int32_t* found) const noexcept override {
      table_.nearby_of_each(x, y, z, count, found);
    }

   private:
    const ClosestPointTable& table_;
  };
};

}  // namespace
}  // namespace grapnel::bench

int main() {
  grapnel::bench::print_machine();
  grapnel::bench::Bench bench;
  bench.print_filters();
  bench.print_registration();
  bench.print_keypoints();
  return 0;
}
