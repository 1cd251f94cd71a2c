#include "workbench/teach/given_poses.h"

#include <filesystem>
#include <system_error>
#include <utility>

#include "base/input_error.h"
#include "drivers/replay/image_file.h"
#include "drivers/replay/recording.h"
#include "workbench/import/fakenect.h"
#include "workbench/import/local_recording.h"
#include "workbench/options.h"
#include "workbench/progress.h"

namespace grapnel {
namespace {

/// The pose of the frame at `time_us`, by the nearest row of the truth.
Pose pose_at(const std::vector<TimedPose>& truth, std::int64_t time_us, const std::string& frame) {
  constexpr std::int64_t kMaxGap_us = 20'000;
  std::vector<std::int64_t> times_us;
  for (const TimedPose& row : truth) times_us.push_back(row.time_us);
  const std::size_t row = nearest_time(times_us, time_us, kMaxGap_us);
  if (row == truth.size()) {
    throw InputError(frame + ": groundtruth.txt has no pose within 20 ms of this frame");
  }
  return truth[row].pose;
}

ColorImage load_mask(const GivenPoses& wanted, std::size_t view, const CameraFile& camera) {
  if (wanted.masks.empty()) return {};
  if (wanted.masks.size() != 1 && view >= wanted.masks.size()) {
    throw InputError("--mask: " + std::to_string(wanted.masks.size()) +
                     " images for more frames; one, or one a frame are allowed");
  }
  const std::string& file = wanted.masks[wanted.masks.size() == 1 ? 0 : view];
  ColorImage mask = read_color_image(file);
  if (mask.width != camera.width || mask.height != camera.height) {
    throw InputError(file + ": " + std::to_string(mask.width) + "×" + std::to_string(mask.height) +
                     " pixels; the frames have " + std::to_string(camera.width) + "×" +
                     std::to_string(camera.height));
  }
  return mask;
}

void read_views(const GivenPoses& wanted, const std::string& name, GivenViews& given) {
  const LocalRecording local(name);
  const Recording recording = Recording::open(local.folder());
  const std::vector<TimedPose> truth =
      wanted.still ? std::vector<TimedPose>{} : recording.ground_truth();
  std::vector<std::size_t> frames;
  if (wanted.frames.empty()) {
    for (std::size_t i = 0; i < recording.frame_count(); ++i) frames.push_back(i);
  } else {
    frames = parse_indices(wanted.frames, "--frames");
  }
  const CameraFile& camera = recording.camera();
  if (given.views.empty()) given.focal_px = camera.fx;
  const std::size_t pixels =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  std::vector<std::uint16_t> depth(pixels);
  std::vector<Rgb8> color(pixels);
  Progress progress("teach " + name, frames.size());
  for (const std::size_t i : frames) {
    const std::string frame_name = name + "#" + std::to_string(i);
    if (i >= recording.frame_count()) {
      throw InputError(frame_name + ": the recording has frames 0 to " +
                       std::to_string(recording.frame_count() - 1));
    }
    const bool colored = recording.read_frame(i, depth, color);
    DepthFrame frame;
    frame.depth = {depth.data(), camera.width, camera.height};
    if (colored) frame.color = {color.data(), camera.width, camera.height};
    frame.metres_per_unit = camera.metres_per_unit;
    frame.intrinsics = camera.intrinsics();
    const ColorImage mask = load_mask(wanted, given.views.size(), camera);
    TaughtView view;
    view.samples = frame_samples(frame, mask.view());
    if (!truth.empty()) view.model_from_camera = pose_at(truth, recording.time_us(i), frame_name);
    given.views.push_back(std::move(view));
    progress.step();
  }
}

}  // namespace

GivenViews read_given_poses(const GivenPoses& wanted) {
  GivenViews given;
  for (const std::string& recording : wanted.recordings) read_views(wanted, recording, given);
  return given;
}

bool has_given_poses(const std::string& name) {
  std::error_code ignored;
  return std::filesystem::is_directory(name, ignored) && !is_fakenect(name) &&
         !Recording::open(name).ground_truth().empty();
}

}  // namespace grapnel
