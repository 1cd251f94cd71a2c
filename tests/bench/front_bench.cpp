// Kernel × target and stage, on a synthetic 640x480 frame: a tilted table with a bumpy part on it.
#include <benchmark/benchmark.h>

#include <cmath>
#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/descriptors/fpfh.h"
#include "pipeline/kernels/target.h"
#include "pipeline/keypoints/iss.h"
#include "pipeline/keypoints/uniform.h"
#include "pipeline/preprocess/background.h"
#include "pipeline/preprocess/decimate.h"
#include "pipeline/preprocess/depth_outliers.h"
#include "pipeline/preprocess/median.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/preprocess/organize.h"
#include "pipeline/preprocess/segment.h"
#include "pipeline/preprocess/voxel.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;

test::TestFrame bench_frame() {
  test::TestFrame frame(kWidth, kHeight, 525.0);
  const Vec3d tilted = Vec3d(0.0, -0.5, -1.0).normalized();
  frame.draw_plane(tilted, 1.0, 0, 0, kWidth, kHeight);
  Rng rng(1);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      std::uint16_t& count = frame.at(u, v);
      if (u >= 200 && u < 440 && v >= 120 && v < 360) {
        const double bump = 60.0 + 25.0 * std::sin(0.07 * u) * std::cos(0.05 * v + 0.02 * u);
        count = static_cast<std::uint16_t>(count - bump);
      }
      count = static_cast<std::uint16_t>(count + 1.5 * rng.normal());
      if (rng.uniform() < 0.02) count = 0;
    }
  }
  return frame;
}

/// Every step with its memory, as a registrar would hold them.
struct Front {
  Limits limits;
  test::TestFrame frame = bench_frame();
  WorkingDepth work;
  DepthMedian median{{}};
  DepthOutliers outliers{{}};
  BackgroundRemoval background{{}};
  Segmenter segmenter{{}};
  Components components;
  Surface surface;
  PcaNormals normals{{}};
  IssDetector iss{{}};
  UniformDetector uniform{{}};
  FpfhEstimator fpfh{{}};
  KeypointSet keypoints;
  FeatureMatrix features;
  test::ArenaMemory memory;

  Front() : memory([this](Arena& arena) { reserve(arena); }) {}

  void reserve(Arena& arena) {
    work.reserve(arena, limits);
    median.reserve(arena, limits);
    outliers.reserve(arena, limits);
    background.reserve(arena, limits);
    segmenter.reserve(arena, limits);
    surface.reserve(arena, limits.max_points, kWidth * kHeight);
    normals.reserve(arena, limits);
    iss.reserve(arena, limits);
    uniform.reserve(arena, limits);
    fpfh.reserve(arena, limits);
    keypoints = KeypointSet(arena.take<Keypoint>(limits.max_keypoints));
    features.reserve(arena, limits.max_keypoints, FpfhEstimator::kDimension);
  }

  void depth_steps() {
    if (!organize(frame.frame, {}, work).ok()) std::abort();
    median.apply(work);
    outliers.apply(work);
    Rng rng(1);
    background.apply(work, {}, 0.0, rng);
    segmenter.apply(work, components);
    if (!decimate(work, 1, {}, {}, 0.0, surface).ok()) std::abort();
  }
  void feature_steps() {
    if (!normals.estimate(surface).ok() || !iss.detect(surface, keypoints).ok() ||
        !fpfh.describe(surface, keypoints.span(), features).ok()) {
      std::abort();
    }
  }
};

Front& front() {
  static Front* const kFront = new Front();
  return *kFront;
}

void whole_front(benchmark::State& state) {
  Front& f = front();
  for (auto _ : state) {
    f.depth_steps();
    f.feature_steps();
  }
  state.counters["points"] = static_cast<double>(f.surface.size);
  state.counters["keypoints"] = static_cast<double>(f.keypoints.size());
}
BENCHMARK(whole_front)->Unit(benchmark::kMillisecond);

template <class Step>
void stage(const char* name, Step step) {
  benchmark::RegisterBenchmark(name, [step](benchmark::State& state) {
    Front& f = front();
    f.depth_steps();
    f.feature_steps();
    for (auto _ : state) {
      state.PauseTiming();
      if (!organize(f.frame.frame, {}, f.work).ok()) std::abort();
      state.ResumeTiming();
      step(f);
    }
  })->Unit(benchmark::kMillisecond);
}

void register_stages() {
  stage("stage/organize",
        [](Front& f) { benchmark::DoNotOptimize(organize(f.frame.frame, {}, f.work).ok()); });
  stage("stage/median", [](Front& f) { f.median.apply(f.work); });
  stage("stage/outliers", [](Front& f) { f.outliers.apply(f.work); });
  stage("stage/background_dominant", [](Front& f) {
    Rng rng(1);
    f.background.apply(f.work, {}, 0.0, rng);
  });
  stage("stage/segment_full_frame", [](Front& f) { f.segmenter.apply(f.work, f.components); });
  stage("stage/decimate_full_frame", [](Front& f) {
    benchmark::DoNotOptimize(decimate(f.work, kForeground, {}, {}, 0.0, f.surface).ok());
  });
}

void register_features() {
  const auto on_part = [](const char* name, auto step) {
    benchmark::RegisterBenchmark(name, [step](benchmark::State& state) {
      Front& f = front();
      f.depth_steps();
      f.feature_steps();
      for (auto _ : state) step(f);
    })->Unit(benchmark::kMillisecond);
  };
  on_part("stage/normals",
          [](Front& f) { benchmark::DoNotOptimize(f.normals.estimate(f.surface).ok()); });
  on_part("stage/iss",
          [](Front& f) { benchmark::DoNotOptimize(f.iss.detect(f.surface, f.keypoints).ok()); });
  on_part("stage/uniform", [](Front& f) {
    benchmark::DoNotOptimize(f.uniform.detect(f.surface, f.keypoints).ok());
  });
  on_part("stage/fpfh", [](Front& f) {
    benchmark::DoNotOptimize(f.fpfh.describe(f.surface, f.keypoints.span(), f.features).ok());
  });
}

void register_kernels() {
  for (const std::string& target : kernels::target_names()) {
    const auto forced = [&target](const char* name, auto step) {
      benchmark::RegisterBenchmark((std::string("kernel/") + name + "/" + target).c_str(),
                                   [target, step](benchmark::State& state) {
                                     Front& f = front();
                                     f.depth_steps();
                                     f.feature_steps();
                                     if (!kernels::force_target(target)) std::abort();
                                     for (auto _ : state) step(f);
                                     if (!kernels::force_target("")) std::abort();
                                   })
          ->Unit(benchmark::kMillisecond);
    };
    forced("median_5x5_full_frame", [](Front& f) { f.median.apply(f.work); });
    forced("support_full_frame", [](Front& f) { f.outliers.apply(f.work); });
    forced("fpfh", [](Front& f) {
      benchmark::DoNotOptimize(f.fpfh.describe(f.surface, f.keypoints.span(), f.features).ok());
    });
  }
}

}  // namespace
}  // namespace grapnel

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  grapnel::register_stages();
  grapnel::register_features();
  grapnel::register_kernels();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
