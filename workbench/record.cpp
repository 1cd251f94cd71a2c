#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/clock.h"
#include "base/config.h"
#include "base/input_error.h"
#include "drivers/registry.h"
#include "drivers/replay/frame_recorder.h"
#include "drivers/replay/recording_store.h"
#include "drivers/replay/wall_clock.h"
#include "workbench/commands.h"
#include "workbench/options.h"

namespace grapnel {
namespace {

constexpr std::int64_t kLookUs = 20'000;
constexpr std::size_t kPoolFrames = 16;
// A camera without a frame for this long is not coming back by itself.
constexpr std::int64_t kSilenceUs = 10'000'000;

std::atomic<bool> g_interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);

void on_interrupt(int) { g_interrupted.store(true); }

struct RecordRun {
  std::vector<std::string> camera;
  std::string driver;
  std::string folder;
  double seconds = 0.0;
  std::int64_t frames = 0;
  std::string color = "png";
  std::int64_t quality = 92;
  bool json = false;
};

/// The [camera] table: of a grapnel.toml, or of a driver's name; then key=value each.
ConfigTable camera_table(const RecordRun& run) {
  std::vector<std::string> words = run.camera;
  if (!run.driver.empty()) words.insert(words.begin(), run.driver);
  if (words.empty()) throw InputError("CAMERA: the name of a driver or a grapnel.toml is missing");
  const bool file = words.front().ends_with(".toml");
  ConfigTable root = file ? load_config(words.front()) : ConfigTable();
  if (!file) {
    root.set("camera", {std::vector<ConfigTable>{ConfigTable("command line", "camera", 0)}, 0});
  }
  if (!file) apply_override(root, "camera.driver=" + words.front());
  for (std::size_t i = 1; i < words.size(); ++i) apply_override(root, "camera." + words[i]);
  ConfigReader reader(root);
  reader.require("camera");
  return *reader.take_table("camera");
}

RecordColor color_of(const std::string& name) {
  if (name == "png") return RecordColor::Png;
  if (name == "jpeg") return RecordColor::Jpeg;
  if (name == "none") return RecordColor::None;
  throw InputError("--color: \"" + name + "\" is not allowed; png, jpeg or none is");
}

/// Until the length is reached, the camera ends, or somebody interrupts. Empty, or why not longer.
std::string wait_for_end(const RecordRun& run, const Camera& camera, const FrameRecorder& recorder,
                         const FramePool& pool, const Clock& clock) {
  const std::int64_t start_us = clock.now_us();
  const auto length_us = static_cast<std::int64_t>(run.seconds * 1e6);
  std::uint64_t published = 0;
  std::int64_t moved_us = start_us;
  while (!g_interrupted.load() && !recorder.ended()) {
    const std::int64_t now_us = clock.now_us();
    if (length_us > 0 && now_us - start_us >= length_us) break;
    if (camera.status().state == CameraState::Ended) break;
    if (pool.published() != published) {
      published = pool.published();
      moved_us = now_us;
    }
    if (now_us - moved_us > kSilenceUs) return "no frame for ten seconds: " + camera.problem();
    clock.sleep_until_us(now_us + kLookUs);
  }
  return "";
}

void report(const RecordRun& run, const RecorderCounters& counters, const CameraCounters& camera,
            const std::string& problem) {
  if (run.json) {
    const nlohmann::ordered_json answer = {{"recording", run.folder},
                                           {"frames", counters.recorded},
                                           {"missed", counters.missed},
                                           {"dropped_by_disk", counters.dropped_disk},
                                           {"dropped_by_camera", camera.dropped},
                                           {"stored_plain", counters.stored_plain},
                                           {"bytes", counters.bytes},
                                           {"problem", problem}};
    std::cout << answer.dump() << "\n";
    return;
  }
  std::cout << run.folder << ": " << counters.recorded << " frames, " << counters.missed
            << " missed (" << camera.dropped << " of them by the camera), " << counters.dropped_disk
            << " dropped by the disk, " << counters.bytes << " bytes\n";
}

int record(const RecordRun& run) {
  MonotonicClock clock;
  const std::unique_ptr<Camera> camera = make_camera(camera_table(run), clock);
  RecorderOptions options;
  options.color = color_of(run.color);
  options.jpeg_quality = static_cast<int>(run.quality);
  options.max_frames = static_cast<std::uint64_t>(run.frames);
  options.time_offset_us = wall_clock_offset_us(clock);
  const Result<CameraInfo> info = camera->open();
  if (!info) throw InputError(camera->problem());
  FolderStore store(run.folder);
  options.serial = info.value().serial;
  const Intrinsics& size = info.value().intrinsics;
  const bool color = info.value().has_color && options.color != RecordColor::None;
  FramePool pool(kPoolFrames, size.width, size.height, color);
  FrameRecorder recorder(pool, store, clock, options);
  recorder.start();
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  if (!camera->start(pool, {})) throw InputError(camera->problem());
  std::string problem = wait_for_end(run, *camera, recorder, pool, clock);
  const CameraCounters seen = camera->status().counters;
  camera->stop();
  recorder.stop();
  const RecorderCounters counters = recorder.counters();
  if (problem.empty()) problem = recorder.problem();
  report(run, counters, seen, problem);
  if (!problem.empty()) std::cerr << "grapnel record: " << problem << "\n";
  if (counters.recorded == 0) throw InputError(run.folder + ": no frame was recorded");
  return counters.dropped_disk == 0 && problem.empty() ? 0 : 1;
}

}  // namespace

int run_record(std::span<const std::string> args) {
  RecordRun run;
  Options options("record", "Records a camera's frames into a folder in the TUM layout.");
  options.positionals("CAMERA", run.camera, 0,
                      "a driver's name or a grapnel.toml, then keys of [camera] as key=value");
  options.value("--camera", run.driver, "the driver's name, instead of the first word");
  options.required("-o,--output", run.folder, "folder of the recording; must not hold one yet");
  options.number("--seconds", run.seconds, 0.0, 1e7, "length; 0: until interrupted");
  options.integer("--frames", run.frames, 0, 1'000'000'000, "length; 0: until interrupted");
  options.value("--color", run.color, "png (lossless), jpeg or none");
  options.integer("--quality", run.quality, 1, 100, "of jpeg");
  options.flag("--json", run.json, "print one JSON object");
  options.footer(
      "A power cut costs at most the last second. Capture never waits for the disk: what can't be\n"
      "kept up with is dropped and counted. JPEG alters the colours: SIFT keypoints and "
      "descriptors\n"
      "of such a recording differ from the live ones; depth is lossless always.\n"
      "Exit code: 0 recorded, 1 frames were dropped by the disk or the camera went silent.");
  if (!options.parse(args)) return 0;
  return record(run);
}

}  // namespace grapnel
