#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "drivers/synthetic/scene_renderer.h"
#include "pipeline/registrar.h"
#include "tests/bench/groups.h"
#include "tests/bench/table.h"

namespace grapnel::bench {
namespace {

namespace fs = std::filesystem;

const fs::path kConfig = fs::path(GRAPNEL_SOURCE_DIR) / "config";

struct Times {
  std::vector<double> ms;
  [[nodiscard]] double at(double share) {
    std::sort(ms.begin(), ms.end());
    return ms[static_cast<std::size_t>(share * static_cast<double>(ms.size() - 1) + 0.5)];
  }
};

std::unique_ptr<Registrar> registrar_of(const std::string& preset,
                                        const std::vector<std::string>& overrides = {}) {
  return Registrar::create(
      load_preset(find_preset(kConfig / "presets", preset), kConfig / "models", overrides));
}

/// A frame and its pixels.
struct Pixels {
  std::vector<std::uint16_t> depth;
  std::vector<Rgb8> color;
  DepthFrame frame;
};

/// Every second frame of each dwell of the demo's conveyor at which this model lies there, at most
/// `most`.
void render_model(const Scene& scene, SceneRenderer& renderer, const std::string& model,
                  std::size_t most, std::vector<Pixels>& frames) {
  const SceneCamera& camera = scene.camera;
  const auto count =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  for (const SceneEvent& event : scene.events) {
    if (event.model != model || event.expected != Expectation::Accept) continue;
    for (int i = 0; i < scene.belt.dwell_frames && frames.size() < most; i += 2) {
      Pixels& pixels = frames.emplace_back();
      pixels.depth.resize(count);
      pixels.color.resize(count);
      renderer.render(first_dwell_frame(scene, event.station) + i,
                      {pixels.depth.data(), camera.width, camera.height},
                      {pixels.color.data(), camera.width, camera.height});
      pixels.frame.depth = {pixels.depth.data(), camera.width, camera.height};
      pixels.frame.color = {pixels.color.data(), camera.width, camera.height};
      pixels.frame.metres_per_unit = camera.metres_per_unit;
      pixels.frame.intrinsics = camera.intrinsics();
      pixels.frame.baseline_m = camera.baseline_m;
    }
  }
}

void print_preset(const std::string& what, Registrar& registrar, std::vector<Pixels>& frames) {
  constexpr int kPasses = 3;
  Times times;
  std::size_t accepted = 0;
  for (int pass = 0; pass <= kPasses; ++pass) {
    for (const Pixels& pixels : frames) {
      const double before = thread_ms();
      const auto answer = registrar.run(pixels.frame, {});
      // The first pass warms the caches.
      if (pass == 0) continue;
      times.ms.push_back(thread_ms() - before);
      accepted += answer.ok() && answer.value().code == Code::ObjectFound ? 1 : 0;
    }
  }
  std::printf("| %s | %.1f | %.1f | %.1f | %zu of %zu | %.1f |\n", what.c_str(), times.at(0.5),
              times.at(0.99), times.at(1.0), accepted, times.ms.size(),
              static_cast<double>(registrar.used_bytes()) / (1 << 20));
  std::fflush(stdout);
}

}  // namespace

bool run_one_frame(const std::string& preset) {
  const Scene scene = load_scene(kConfig / "scenes" / "demo.toml");
  SceneRenderer renderer(scene);
  std::vector<Pixels> frames;
  render_model(scene, renderer, preset, 1, frames);
  if (frames.empty()) return false;
  (void)registrar_of(preset)->run(frames[0].frame, {});
  return true;
}

void print_frames() {
  const Scene scene = load_scene(kConfig / "scenes" / "demo.toml");
  SceneRenderer renderer(scene);
  std::printf(
      "Frame in memory to pose and verdict, 640 × 480, parts of the demo's conveyor. Must: p50 15, "
      "p99 33 ms, 32 MiB; goal: p50 8, p99 12 ms, 24 MiB. Peers measured apart: 205 to 3482 ms.\n\n"
      "| preset | p50, ms | p99, ms | most, ms | accepted | memory, MiB |\n"
      "|---|---|---|---|---|---|\n");
  for (const char* const model : {"sack", "box", "barrel", "carton"}) {
    std::vector<Pixels> frames;
    render_model(scene, renderer, model, 100, frames);
    if (frames.empty()) continue;
    print_preset(model, *registrar_of(model), frames);
    const std::string models = std::string("models=[\"") + model + "\"]";
    print_preset("object, for the " + std::string(model), *registrar_of("object", {models}),
                 frames);
  }
  std::printf("\n");
}

}  // namespace grapnel::bench
