// Keypoint detectors on a synthetic view: a bumpy part before a table, on the grid of a camera and
// as an unorganised cloud. Counter: points.
#include <benchmark/benchmark.h>

#include <cmath>
#include <map>
#include <memory>
#include <string>

#include "base/math.h"
#include "pipeline/kernels/target.h"
#include "pipeline/preprocess/normals.h"
#include "pipeline/registry.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

/// A wavy sheet of size × size·3/4 pixels about 1 m away, its pitch as of a decimated view, with
/// normals and a printed pattern.
class View {
 public:
  View(int width, bool on_grid) : surface_(pixels(width), pixels(width)) {
    Surface& s = *surface_;
    const int height = width * 3 / 4;
    const double focal = 0.9 * width;
    s.grid.width = width;
    s.grid.height = height;
    s.grid.intrinsics = {width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)};
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) add(u, v);
    }
    s.has_viewpoint = true;
    s.spacing_m = 1.0 / focal;
    PcaNormals normals{{}};
    const test::ArenaMemory memory(
        [&](Arena& arena) { normals.reserve(arena, limits(pixels(width))); });
    if (!normals.estimate(s).ok()) std::abort();
    if (!on_grid) s.grid.width = s.grid.height = 0;
  }
  [[nodiscard]] const Surface& surface() { return *surface_; }
  [[nodiscard]] static Limits limits(std::size_t points) {
    Limits limits;
    limits.max_points = points;
    limits.max_model_points = points;
    limits.max_input_points = points;
    return limits;
  }

 private:
  static std::size_t pixels(int width) {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(width * 3 / 4);
  }
  void add(int u, int v) {
    Surface& s = *surface_;
    const auto pixel = static_cast<std::size_t>(v * s.grid.width + u);
    const double across = static_cast<double>(u) / s.grid.width;
    const double down = static_cast<double>(v) / s.grid.width;
    const bool on_part = across > 0.3 && across < 0.7 && down > 0.2 && down < 0.55;
    const double z = 1.0 + 0.1 * down + 0.02 * math::sin(60.0 * across) * math::cos(50.0 * down) -
                     (on_part ? 0.15 : 0.0);
    const std::size_t i = s.size++;
    s.grid.point_of[pixel] = static_cast<std::int32_t>(i);
    s.grid.pixel_of[i] = static_cast<std::int32_t>(pixel);
    s.x[i] = static_cast<float>((u - s.grid.intrinsics.cx) * z / s.grid.intrinsics.fx);
    s.y[i] = static_cast<float>((v - s.grid.intrinsics.cy) * z / s.grid.intrinsics.fy);
    s.z[i] = static_cast<float>(z);
    s.intensity[i] =
        static_cast<float>(0.5 + 0.25 * math::sin(90.0 * across) + 0.25 * math::cos(130.0 * down));
  }
  test::OwnedSurface surface_;
};

std::unique_ptr<KeypointDetector> detector_of(const std::string& name) {
  const ConfigTable table("bench", "", 0);
  ConfigReader reader(table);
  return find_method(keypoint_detectors(), name).make(reader);
}

void detect(benchmark::State& state, const std::string& name, int width, bool on_grid) {
  View view(width, on_grid);
  const Surface& surface = view.surface();
  const std::unique_ptr<KeypointDetector> detector = detector_of(name);
  KeypointSet keypoints;
  const test::ArenaMemory memory([&](Arena& arena) {
    detector->reserve(arena, View::limits(surface.size));
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
