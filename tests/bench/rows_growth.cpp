#include <array>
#include <cmath>
#include <cstdio>
#include <deque>
#include <string>
#include <vector>

#include "tests/bench/groups.h"
#include "tests/bench/inputs.h"
#include "tests/bench/table.h"

namespace grapnel::bench {
namespace {

constexpr int kRuns = 5;
constexpr std::array<int, 4> kStrides = {8, 4, 2, 1};
/// Widths of views with about as many points as the frame has at those strides.
constexpr std::array<int, 4> kWidths = {80, 160, 320, 640};
/// One keypoint to describe of so many points.
constexpr std::size_t kPointsPerKeypoint = 26;

using Costs = std::array<double, 4>;

/// One stage over growing inputs: ms, and what a point costs at the largest over at the smallest.
void print_stage(const char* what, const Costs& ms, const std::array<std::size_t, 4>& points) {
  std::printf("| %s |", what);
  for (const double cost : ms) std::printf(" %.2f |", cost);
  const double per_point =
      ms[3] / ms[0] * static_cast<double>(points[0]) / static_cast<double>(points[3]);
  std::printf(" %.2f |\n", per_point);
  std::fflush(stdout);
}

void print_head(const char* what, const std::array<std::size_t, 4>& points) {
  std::printf("| %s |", what);
  for (const std::size_t count : points) std::printf(" %zu points, ms |", count);
  std::printf(" a point, last over first |\n|---|---|---|---|---|---|\n");
}

/// Stages that change the surface: each run has the frame again.
void print_front() {
  const test::TestFrame frame = make_frame();
  test::OwnedSurface surface(kPixels, kPixels);
  std::array<std::size_t, 4> points{};
  for (std::size_t i = 0; i < kStrides.size(); ++i) {
    fill(frame, kStrides[i], *surface);
    points[i] = surface->size;
  }
  print_head("a noisy frame, every n-th pixel", points);
  const auto grow = [&](const char* what, const std::function<void()>& run) {
    Costs ms{};
    for (std::size_t i = 0; i < kStrides.size(); ++i) {
      ms[i] = median_ms({"", 0, 0, [&, i] { fill(frame, kStrides[i], *surface); }, run}, kRuns);
    }
    print_stage(what, ms, points);
  };
  Held<CloudFilter> outliers{make(find_method(cloud_filters(), "statistical_outliers"))};
  Held<CloudFilter> voxels{make(find_method(cloud_filters(), "voxel"), "leaf_m=0.005")};
  Held<NormalEstimator> normals{make(find_method(normal_estimators(), "grid_plane"))};
  grow("statistical outliers", [&] { (void)outliers.stage->apply(*surface); });
  grow("voxels of 5 mm", [&] { (void)voxels.stage->apply(*surface); });
  grow("normals, `grid_plane`", [&] { (void)normals.stage->estimate(*surface); });
  std::printf("\n");
}

/// Stages that look at a surface: views whose pitch shrinks as their number of points grows, so
/// that every radius holds the same number of neighbours.
class GrowingViews {
 public:
  explicit GrowingViews(bool on_grid) {
    for (std::size_t i = 0; i < kWidths.size(); ++i) {
      views_.push_back(make_view(kWidths[i], on_grid));
      points[i] = views_.back()->size;
    }
  }
  void detect(const std::string& method) {
    Held<KeypointDetector> held{make(find_method(keypoint_detectors(), method))};
    std::vector<Keypoint> storage(large().max_keypoints);
    KeypointSet found{std::span<Keypoint>(storage)};
    Costs ms{};
    for (std::size_t i = 0; i < views_.size(); ++i) {
      ms[i] =
          median_ms({"", 0, 0, [&] { found.clear(); },
                     [&, i] { require(held.stage->detect(*views_[i], found).ok(), "keypoints"); }},
                    kRuns);
    }
    print_stage(("`" + method + "`").c_str(), ms, points);
  }
  /// Of every `each`-th point.
  void describe(const std::string& method, std::size_t each, const std::string& what) {
    Costs ms{};
    for (std::size_t i = 0; i < views_.size(); ++i) {
      std::vector<Keypoint> keypoints;
      for (std::size_t p = 0; p < points[i]; p += each) {
        keypoints.push_back({static_cast<std::int32_t>(p), 1.0F, 0.0F});
      }
      Limits limits = large();
      limits.max_keypoints = keypoints.size();
      const auto stage = make(find_method(descriptor_estimators(), method),
                              "radius_ratio=" + std::to_string(kRadiusRatio));
      FeatureMatrix features;
      const test::ArenaMemory memory([&](Arena& arena) {
        stage->reserve(arena, limits);
        features.reserve(arena, keypoints.size(), stage->dimension());
      });
      ms[i] = median_ms({"",
                         0,
                         0,
                         {},
                         [&, i] {
                           require(stage->describe(*views_[i], keypoints, features).ok(),
                                   "descriptors");
                         }},
                        kRuns);
    }
    print_stage(what.c_str(), ms, points);
  }
  std::array<std::size_t, 4> points{};

 private:
  std::deque<test::OwnedSurface> views_;
};

}  // namespace

void print_growth() {
  print_front();
  for (const bool on_grid : {true, false}) {
    GrowingViews views(on_grid);
    print_head(on_grid ? "views on a camera's grid" : "the same points, unorganised", views.points);
    for (const char* const method :
         {"iss", "harris3d", "sift3d", "principal_curvature", "uniform"}) {
      views.detect(method);
    }
    if (on_grid) views.detect("narf");
    views.describe("fpfh", 1, "FPFH of every point");
    const std::string some = " of one point in " + std::to_string(kPointsPerKeypoint);
    views.describe("fpfh", kPointsPerKeypoint, "FPFH" + some);
    views.describe("pfh", kPointsPerKeypoint, "PFH" + some);
    views.describe("spin_image", kPointsPerKeypoint, "spin images" + some);
    std::printf("\n");
  }
}

}  // namespace grapnel::bench
