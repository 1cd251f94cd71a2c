#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "drivers/replay/image_file.h"
#include "drivers/synthetic/scene_renderer.h"
#include "pipeline/registrar.h"
#include "tests/bench/groups.h"
#include "tests/bench/table.h"
#include "tests/support/recorded_data.h"
#include "workbench/surfaces.h"

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

void print_simulated() {
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

/// One recorded data set of views with poses.
struct Views {
  const char* folder;
  const char* depth_pattern;
  const char* pose_pattern;
  Intrinsics intrinsics;
};

constexpr Views kBunny = {
    "primesense_bunny", "depth_%d.png", "poses_%d.txt", {640, 480, 542.0, 540.5, 320.0, 240.0}};
constexpr Views kKitchen = {"7scenes_redkitchen",
                            "frame-%06d.depth.png",
                            "frame-%06d.pose.txt",
                            {640, 480, 585.0, 585.0, 320.0, 240.0}};

std::string numbered(const char* pattern, int number) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), pattern, number);
  return text.data();
}

std::unique_ptr<StoredSurface> view_of(const Views& views, int number) {
  DepthImage image =
      read_depth_png(test::recorded_data(views.folder) / numbered(views.depth_pattern, number));
  // The kitchen's files mark what was not read by 0 or by this.
  std::replace(image.pixels.begin(), image.pixels.end(), std::uint16_t{65535}, std::uint16_t{0});
  DepthFrame frame;
  frame.depth = image.view();
  frame.intrinsics = views.intrinsics;
  return make_surface(frame);
}

Mat4d world_from_camera(const Views& views, int number) {
  std::ifstream stream(test::recorded_data(views.folder) / numbered(views.pose_pattern, number));
  Mat4d matrix = Mat4d::Identity();
  for (int i = 0; i < 16; ++i) stream >> matrix(i / 4, i % 4);
  return matrix;
}

struct PairRow {
  const char* what;
  const Views& views;
  int step;  ///< between the sources
  int apart;
  int pairs;
  double tolerance_m;
  double must_ms;
  double goal_ms;
};

void print_pairs(Registrar& registrar, const PairRow& row) {
  constexpr double kTolerance_rad = 5.0 * 3.14159265358979 / 180.0;
  Times times;
  int right = 0;
  for (int i = 0; i < row.pairs; ++i) {
    const int from = i * row.step;
    const auto source = view_of(row.views, from);
    const auto target = view_of(row.views, from + row.apart);
    Vec3d middle = Vec3d::Zero();
    for (std::size_t p = 0; p < source->surface.size; ++p) {
      middle += source->surface.point(p).cast<double>();
    }
    middle /= static_cast<double>(source->surface.size);
    const double before = thread_ms();
    const auto answer = registrar.register_pair(source->surface, target->surface, {});
    times.ms.push_back(thread_ms() - before);
    if (!answer.ok() || answer.value().objects.empty()) continue;
    const Pose truth(Mat4d(world_from_camera(row.views, from + row.apart).inverse() *
                           world_from_camera(row.views, from)));
    const Pose& found = answer.value().objects[0].target_from_source;
    right += (found * middle - truth * middle).norm() < row.tolerance_m &&
                     rotation_angle_rad(found, truth) < kTolerance_rad
                 ? 1
                 : 0;
  }
  std::printf("| %s | %d of %d | %.1f | %.1f |", row.what, right, row.pairs, times.at(0.5),
              times.at(1.0));
  if (row.must_ms > 0.0) {
    std::printf(" %g | %g |\n", row.must_ms, row.goal_ms);
  } else {
    std::printf(" | |\n");
  }
  std::fflush(stdout);
}

void print_recorded() {
  const bool bunny = !test::recorded_data(kBunny.folder).empty();
  const bool kitchen = !test::recorded_data(kKitchen.folder).empty();
  if (!bunny && !kitchen) {
    std::printf("%s: no recorded pairs.\n\n", test::kNoRecordedData);
    return;
  }
  const auto registrar = registrar_of("pair");
  std::printf(
      "Recorded pairs of views, preset `pair`, no initial guess; right: within 5° and 2 cm "
      "(kitchen "
      "5 cm) before the verdict.\n\n"
      "| pairs | right | p50, ms | most, ms | must | goal |\n|---|---|---|---|---|---|\n");
  if (bunny) {
    print_pairs(*registrar, {"bunny, 4 frames apart (must 14; Open3D 14 in 169 ms)", kBunny, 1, 4,
                             14, 0.02, 15.0, 8.0});
    print_pairs(*registrar,
                {"bunny, 8 frames apart (goal 5; best peer 1)", kBunny, 1, 8, 10, 0.02, 0.0, 0.0});
  }
  if (kitchen) {
    print_pairs(*registrar, {"kitchen, 20 frames apart (must 19; Open3D 19 in 2072 ms)", kKitchen,
                             9, 20, 20, 0.05, 60.0, 25.0});
  }
  std::printf("\n");
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
  print_simulated();
  print_recorded();
}

}  // namespace grapnel::bench
