// Descriptors, matching and rejection at the sizes of the budgets, on unorganised synthetic clouds
// with about a hundred neighbours a point. Set GRAPNEL_TARGET to run on another SIMD target.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/correspond/nearest_feature.h"
#include "pipeline/descriptors/fpfh.h"
#include "pipeline/descriptors/pfh.h"
#include "pipeline/descriptors/spin_image.h"
#include "pipeline/kernels/target.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/reject/graph.h"
#include "pipeline/reject/ransac.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

/// π r² / spacing² = 100 neighbours.
constexpr double kRadiusRatio = 5.64;

Limits bench_limits(std::size_t points) {
  Limits limits;
  limits.max_width = 16;
  limits.max_height = 16;
  limits.max_points = points;
  limits.max_model_points = points;
  limits.max_keypoints = points;
  return limits;
}

/// A bumpy closed surface with normals.
test::OwnedSurface bench_surface(std::size_t points) {
  test::OwnedSurface surface = test::bumpy_ball(points, 0.2);
  PcaNormals normals({});
  const test::ArenaMemory memory(
      [&](Arena& arena) { normals.reserve(arena, bench_limits(points)); });
  if (!normals.estimate(*surface).ok()) std::abort();
  return surface;
}

/// An estimator with its memory, described keypoints and rows.
template <class Estimator>
struct Described {
  test::OwnedSurface surface;
  Estimator estimator;
  FeatureMatrix features;
  std::vector<Keypoint> keypoints;
  test::ArenaMemory memory;

  template <class Params>
  Described(std::size_t points, std::size_t count, const Params& params)
      : surface(bench_surface(points)), estimator(params), memory([&](Arena& arena) {
          estimator.reserve(arena, bench_limits(points));
          features.reserve(arena, count, estimator.dimension());
        }) {
    for (std::size_t i = 0; i < count; ++i) {
      keypoints.push_back({static_cast<std::int32_t>(i * points / count), 1.0F, 0.0F});
    }
  }
  void run() {
    if (!estimator.describe(*surface, keypoints, features).ok()) std::abort();
  }
};

template <class Estimator, class Params>
void describe(benchmark::State& state, std::size_t points, std::size_t count, Params params) {
  params.radius_ratio = kRadiusRatio;
  Described<Estimator> described(points, count, params);
  for (auto _ : state) described.run();
}

void fpfh(benchmark::State& state, std::size_t points, std::size_t count) {
  describe<FpfhEstimator>(state, points, count, FpfhParams{});
}
BENCHMARK_CAPTURE(fpfh, 1000_of_7700, 7700, 1000)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(fpfh, every_of_5000, 5000, 5000)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(fpfh, every_of_26000, 26000, 26000)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(fpfh, every_of_80000, 80000, 80000)->Unit(benchmark::kMillisecond);

void pfh(benchmark::State& state, std::size_t count, int max_neighbours) {
  PfhParams params;
  params.max_neighbours = max_neighbours;
  describe<PfhEstimator>(state, 7700, count, params);
}
BENCHMARK_CAPTURE(pfh, 200_all_neighbours, 200, 256)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(pfh, 200_by_64_neighbours, 200, 64)->Unit(benchmark::kMillisecond);

void spin_images(benchmark::State& state, SpinStructure structure, SpinDomain domain) {
  SpinImageParams params;
  params.structure = structure;
  params.domain = domain;
  describe<SpinImageEstimator>(state, 7700, 1000, params);
}
BENCHMARK_CAPTURE(spin_images, 1000_rectangular, SpinStructure::Rectangular, SpinDomain::Density)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(spin_images, 1000_radial_angular, SpinStructure::Radial, SpinDomain::Angular)
    ->Unit(benchmark::kMillisecond);

/// The FPFH of a thousand points of one surface against a thousand other ones.
struct MatchInput {
  Described<FpfhEstimator> described{7700, 2000, [] {
                                       FpfhParams params;
                                       params.radius_ratio = kRadiusRatio;
                                       return params;
                                     }()};
  FeatureMatrix source;
  FeatureMatrix target;
  test::ArenaMemory memory{[this](Arena& arena) {
    source.reserve(arena, 1000, 33);
    target.reserve(arena, 1000, 33);
  }};
  MatchInput() {
    described.run();
    for (std::size_t i = 0; i < 2000; ++i) {
      FeatureMatrix& side = i % 2 == 0 ? source : target;
      std::ranges::copy(described.features.row(i), side.row(side.rows++).begin());
    }
  }
};

void match(benchmark::State& state, Metric metric, std::size_t top) {
  static MatchInput* const kInput = new MatchInput();
  NearestFeatureParams params;
  params.metric = metric;
  params.top = top;
  NearestFeature matcher(params);
  Limits limits;
  limits.descriptor_dimension = 33;
  const test::ArenaMemory memory([&](Arena& arena) { matcher.reserve(arena, limits); });
  std::vector<Correspondence> storage(top * 1000);
  Correspondences pairs{storage};
  for (auto _ : state) {
    if (!matcher.match(kInput->source, kInput->target, pairs).ok()) std::abort();
  }
}

void register_matches() {
  for (std::size_t i = 0; i < kMetricNames.size(); ++i) {
    benchmark::RegisterBenchmark(
        ("match_1000x1000x33/" + std::string(kMetricNames[i])).c_str(),
        [i](benchmark::State& state) { match(state, static_cast<Metric>(i), 1); })
        ->Unit(benchmark::kMillisecond);
  }
}

/// 2290 pairs between a cloud and itself moved; one in `right_in` is right.
template <class Rejector>
void reject(benchmark::State& state, Rejector rejector, std::size_t count, std::size_t right_in) {
  test::OwnedSurface source = bench_surface(count);
  test::OwnedSurface target = bench_surface(count);
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3d(0.3, -0.8, 0.4));
  pose.translation() = Vec3d(0.1, 0.2, 0.3);
  test::move(*target, pose);
  std::vector<Keypoint> keypoints;
  std::vector<Correspondence> given;
  Rng shuffle(3);
  for (std::size_t i = 0; i < count; ++i) {
    const auto index = static_cast<std::int32_t>(i);
    const auto other = static_cast<std::int32_t>(shuffle.below(static_cast<std::uint32_t>(count)));
    keypoints.push_back({index, 1.0F, 0.0F});
    given.push_back({index, i % right_in == 0 ? index : other, 1.0F});
  }
  const test::ArenaMemory memory([&](Arena& arena) { rejector.reserve(arena, Limits{}); });
  std::vector<Correspondence> storage(count);
  for (auto _ : state) {
    Correspondences pairs{storage};
    for (const Correspondence& pair : given) pairs.push_back(pair);
    Rng rng(1);
    if (!rejector.reject({&*source, &*target, keypoints, keypoints}, pairs, rng).ok()) std::abort();
    state.counters["kept"] = static_cast<double>(pairs.size());
  }
  if constexpr (std::is_same_v<Rejector, RansacRejector>) {
    state.counters["rated"] = static_cast<double>(rejector.rated());
  }
}

void ransac(benchmark::State& state, std::size_t right_in) {
  RansacRejectorParams params;
  params.draws = 10000;
  reject(state, RansacRejector(params), 2290, right_in);
}
BENCHMARK_CAPTURE(ransac, 10000_draws_2290_pairs_a_half_right, 2)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(ransac, 10000_draws_2290_pairs_a_tenth_right, 10)->Unit(benchmark::kMillisecond);

void graph(benchmark::State& state, std::size_t count, GraphKeep keep) {
  GraphRejectorParams params;
  params.keep = keep;
  reject(state, GraphRejector(params), count, 5);
}
BENCHMARK_CAPTURE(graph, cliques_of_512_pairs, 512, GraphKeep::Cliques)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(graph, core_of_512_pairs, 512, GraphKeep::Core)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(graph, cliques_of_1024_pairs, 1024, GraphKeep::Cliques)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace grapnel

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  const char* target = std::getenv("GRAPNEL_TARGET");
  if (target != nullptr && !grapnel::kernels::force_target(target)) return 2;
  benchmark::AddCustomContext("target", grapnel::kernels::target_name());
  grapnel::register_matches();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
