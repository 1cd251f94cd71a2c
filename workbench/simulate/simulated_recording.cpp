#include "workbench/simulate/simulated_recording.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/input_error.h"
#include "drivers/replay/recording_writer.h"
#include "drivers/synthetic/fault_script.h"
#include "drivers/synthetic/scene_renderer.h"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

// Frames of a dwell that pass before its trigger, as a line's light barrier comes after the stop.
constexpr std::int64_t kTriggerDelayFrames = 3;

std::int64_t frame_time_us(const Scene& scene, std::int64_t frame) {
  return static_cast<std::int64_t>(static_cast<double>(frame) * 1e6 / scene.rate_hz + 0.5);
}

Json matrix_json(const Pose& pose) {
  Json numbers = Json::array();
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) numbers.push_back(pose.matrix()(row, column));
  }
  return numbers;
}

Json objects_json(const Scene& scene, const SceneRenderer& renderer, std::int64_t frame) {
  Json objects = Json::array();
  for (const PartView& view : renderer.parts()) {
    const ScenePart& part = scene.parts[view.part_i];
    objects.push_back({{"name", part.name},
                       {"model", part.model},
                       {"camera_from_model", matrix_json(view.camera_from_model)},
                       {"covered_pixels", view.covered_pixels},
                       {"visible_pixels", view.visible_pixels},
                       {"measured_pixels", view.measured_pixels},
                       {"visible_ratio", static_cast<double>(view.visible_pixels) /
                                             static_cast<double>(view.covered_pixels)},
                       {"inside", view.inside}});
  }
  return {{"frame", frame},
          {"time_s", static_cast<double>(frame_time_us(scene, frame)) * 1e-6},
          {"objects", objects}};
}

Json event_json(const Scene& scene, const SceneEvent& event, std::size_t id) {
  const std::int64_t first = first_dwell_frame(scene, event.station);
  const bool stations = scene.belt.pitch_m > 0.0;
  const std::int64_t last = stations ? first + scene.belt.dwell_frames - 1 : scene.frames - 1;
  const std::int64_t trigger = std::min(first + kTriggerDelayFrames, last);
  Json json = {{"id", id},
               {"kind", event.kind},
               {"model", event.model},
               {"expected", kExpectationNames[static_cast<std::size_t>(event.expected)]},
               {"first_frame", first},
               {"last_frame", last},
               {"trigger_frame", trigger},
               {"trigger_time_s", static_cast<double>(frame_time_us(scene, trigger)) * 1e-6}};
  const auto part =
      std::find_if(scene.parts.begin(), scene.parts.end(),
                   [&event](const ScenePart& item) { return item.name == event.part; });
  if (part != scene.parts.end()) {
    const Pose camera_from_world = scene.camera.world_from_camera().inverse();
    json["part"] = event.part;
    json["camera_from_model"] =
        matrix_json(camera_from_world * world_from_part(scene, *part, trigger));
  }
  return json;
}

class LineFile {
 public:
  explicit LineFile(std::filesystem::path file) : file_(std::move(file)), stream_(file_) {}
  void add(const Json& json) {
    stream_ << json.dump() << "\n";
    if (!stream_) throw InputError(file_.string() + ": can't be written");
  }

 private:
  std::filesystem::path file_;
  std::ofstream stream_;
};

}  // namespace

CameraFile camera_file_of(const Scene& scene) {
  const SceneCamera& camera = scene.camera;
  CameraFile file;
  file.width = camera.width;
  file.height = camera.height;
  file.fx = camera.fx;
  file.fy = camera.fy;
  file.cx = camera.cx;
  file.cy = camera.cy;
  file.metres_per_unit = camera.metres_per_unit;
  file.baseline_m = camera.baseline_m;
  file.serial = camera.serial;
  return file;
}

SimulationCounts write_simulated_recording(const Scene& scene, const std::filesystem::path& folder,
                                           const std::function<void()>& progress) {
  const int width = scene.camera.width;
  const int height = scene.camera.height;
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::vector<std::uint16_t> depth(pixels);
  std::vector<std::uint16_t> previous(pixels);
  std::vector<Rgb8> color(scene.camera.color ? pixels : 0);
  SceneRenderer renderer(scene);
  RecordingWriter writer(folder, camera_file_of(scene));
  LineFile objects(folder / "objects.jsonl");
  SimulationCounts counts;
  for (std::int64_t frame = 0; frame < scene.frames; ++frame) {
    const FrameFaults faults = faults_at(scene.faults, frame);
    ImageView<Rgb8> color_view;
    if (scene.camera.color) color_view = {color.data(), width, height};
    renderer.render(frame, {depth.data(), width, height}, color_view);
    objects.add(objects_json(scene, renderer, frame));
    const std::int64_t time_us = frame_time_us(scene, frame);
    writer.add_pose({time_us, scene.camera.world_from_camera()});
    const auto half = static_cast<std::ptrdiff_t>(pixels / 2);
    if (faults.torn) std::copy(previous.begin() + half, previous.end(), depth.begin() + half);
    if (faults.all_zero) std::fill(depth.begin(), depth.end(), std::uint16_t{0});
    if (!faults.missing) {
      writer.add_depth(time_us, ImageView<const std::uint16_t>(depth.data(), width, height));
      if (scene.camera.color) {
        writer.add_color(time_us, ImageView<const Rgb8>(color.data(), width, height));
      }
      ++counts.depth_images;
    }
    previous.swap(depth);
    ++counts.frames;
    progress();
  }
  if (!scene.events.empty()) {
    LineFile events(folder / "events.jsonl");
    for (const SceneEvent& event : scene.events) {
      events.add(event_json(scene, event, static_cast<std::size_t>(++counts.events)));
    }
  }
  return counts;
}

}  // namespace grapnel
