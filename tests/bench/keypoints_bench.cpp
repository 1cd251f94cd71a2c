// Keypoint detectors on a synthetic view: a bumpy part before a table, on the grid of a camera and
// as an unorganised cloud. Counter: points.
#include <benchmark/benchmark.h>

#include <map>
#include <memory>
#include <string>

#include "pipeline/kernels/target.h"
#include "pipeline/registry.h"
#include "tests/bench/inputs.h"

namespace grapnel {
namespace {

void detect(benchmark::State& state, const std::string& name, int width, bool on_grid) {
  test::OwnedSurface view = bench::make_view(width, on_grid);
  const Surface& surface = *view;
  const std::unique_ptr<KeypointDetector> detector =
      bench::make(find_method(keypoint_detectors(), name));
  KeypointSet keypoints;
  const test::ArenaMemory memory([&](Arena& arena) {
    detector->reserve(arena, bench::large());
    keypoints = KeypointSet(arena.take<Keypoint>(5000));
  });
  for (auto _ : state) {
    if (const Status done = detector->detect(surface, keypoints); !done.ok()) {
      state.SkipWithError("the detector refused the surface");
      break;
    }
  }
  state.counters["points"] = static_cast<double>(surface.size);
  state.counters["keypoints"] = static_cast<double>(keypoints.size());
}

void register_all() {
  // 7.7k, 26k and a full frame's points.
  const std::map<std::string, int> widths = {{"object", 101}, {"scene", 186}, {"full", 640}};
  for (const Method<KeypointDetector>& method : keypoint_detectors()) {
    const std::string name(method.name);
    for (const auto& [size, width] : widths) {
      for (const bool on_grid : {true, false}) {
        const std::string title = "keypoints/" + name + "/" + size + (on_grid ? "/grid" : "/cloud");
        benchmark::RegisterBenchmark(title.c_str(), [name, width = width,
                                                     on_grid](benchmark::State& state) {
          detect(state, name, width, on_grid);
        })->Unit(benchmark::kMillisecond);
      }
    }
  }
}

}  // namespace
}  // namespace grapnel

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  grapnel::register_all();
  benchmark::AddCustomContext("simd", grapnel::kernels::target_name());
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
