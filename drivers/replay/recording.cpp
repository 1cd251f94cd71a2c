#include "drivers/replay/recording.h"

#include <algorithm>
#include <utility>

#include "base/assert.h"
#include "base/file.h"
#include "base/formats/text_scanner.h"
#include "base/input_error.h"
#include "drivers/replay/image_file.h"
#include "drivers/replay/undistort.h"

namespace grapnel {
namespace {

constexpr std::int64_t kKinectInterval_us = 33'333;

/// The images below FOLDER/NAME whose names are times, as an index would list them.
std::vector<IndexRow> list_images(const std::filesystem::path& folder, const char* name) {
  std::vector<IndexRow> rows;
  std::error_code code;
  for (const auto& entry : std::filesystem::directory_iterator(folder / name, code)) {
    IndexRow row;
    const std::filesystem::path file = entry.path().filename();
    const std::string ending = file.extension().string();
    if (ending != ".png" && ending != ".jpg" && ending != ".jpeg") continue;
    if (!parse_time(file.stem().string(), row.time_us)) continue;
    row.file = (std::filesystem::path(name) / file).string();
    rows.push_back(std::move(row));
  }
  std::sort(rows.begin(), rows.end(), [](const IndexRow& a, const IndexRow& b) {
    return std::pair(a.time_us, a.file) < std::pair(b.time_us, b.file);
  });
  return rows;
}

}  // namespace

Recording Recording::open(const std::filesystem::path& folder) {
  Recording recording;
  if (!std::filesystem::is_directory(folder)) {
    const bool oni = folder.extension() == ".oni" && std::filesystem::exists(folder);
    throw InputError(folder.string() +
                     (oni ? ": an .oni file is played by driver \"openni2\", key recording, or "
                            "brought in by grapnel import"
                          : ": is not a recording; a folder with camera.toml is"));
  }
  if (!std::filesystem::exists(folder / "camera.toml")) {
    throw InputError(folder.string() +
                     ": has no camera.toml, so it is no recording of Grapnel's; grapnel import "
                     "brings foreign ones in");
  }
  recording.folder_ = folder;
  recording.camera_ = read_camera_file(folder / "camera.toml");
  recording.undistort_ = undistortion_map(recording.camera_);
  recording.correction_ = DepthCorrection(recording.camera_, recording.camera_.metres_per_unit);
  std::vector<IndexRow> rows;
  if (std::filesystem::exists(folder / "depth.txt")) {
    rows = read_index(folder / "depth.txt");
  } else {
    rows = list_images(folder, "depth");
    recording.index_rebuilt_ = true;
  }
  if (rows.empty()) throw InputError(folder.string() + ": the recording has no frame");
  recording.frames_.reserve(rows.size());
  for (IndexRow& row : rows) recording.frames_.push_back({row.time_us, std::move(row.file), {}});
  recording.pair_colors();
  recording.measure_interval();
  return recording;
}

void Recording::pair_colors() {
  const bool listed = std::filesystem::exists(folder_ / "rgb.txt");
  if (!listed && !index_rebuilt_) return;
  std::vector<IndexRow> rows =
      listed ? read_index(folder_ / "rgb.txt") : list_images(folder_, "rgb");
  std::stable_sort(rows.begin(), rows.end(),
                   [](const IndexRow& a, const IndexRow& b) { return a.time_us < b.time_us; });
  std::vector<std::int64_t> times_us;
  times_us.reserve(rows.size());
  for (const IndexRow& row : rows) times_us.push_back(row.time_us);
  for (Frame& frame : frames_) {
    const std::size_t nearest = nearest_time(times_us, frame.time_us, kColorLimit_us);
    if (nearest == rows.size()) continue;
    frame.color_file = rows[nearest].file;
    has_color_ = true;
  }
}

void Recording::measure_interval() {
  std::vector<std::int64_t> steps_us;
  for (std::size_t i = 1; i < frames_.size(); ++i) {
    const std::int64_t step_us = frames_[i].time_us - frames_[i - 1].time_us;
    if (step_us > 0) steps_us.push_back(step_us);
  }
  interval_us_ = kKinectInterval_us;
  if (steps_us.empty()) return;
  const auto middle = steps_us.begin() + static_cast<std::ptrdiff_t>(steps_us.size() / 2);
  std::nth_element(steps_us.begin(), middle, steps_us.end());
  interval_us_ = *middle;
}

bool Recording::read_frame(std::size_t frame, std::span<std::uint16_t> depth,
                           std::span<Rgb8> color) const {
  GRAPNEL_ASSERT(frame < frames_.size());
  const Frame& row = frames_[frame];
  const std::string name = folder_.string() + ": frame " + std::to_string(frame) + ": ";
  try {
    const std::vector<std::byte> bytes = read_file(folder_ / row.depth_file, kMaxImageFileBytes);
    decode_depth_png(bytes, row.depth_file, camera_.width, camera_.height, depth);
    erase_invalid(camera_, depth);
    if (!undistort_.empty()) undistort<std::uint16_t>(undistort_, depth);
    if (!correction_.empty()) {
      std::vector<float> scratch(correction_.scratch_floats());
      correction_.apply(depth, scratch);
    }
    if (color.empty() || row.color_file.empty()) return false;
    const std::vector<std::byte> packed = read_file(folder_ / row.color_file, kMaxImageFileBytes);
    decode_color_image(packed, row.color_file, camera_.width, camera_.height, color);
    if (!undistort_.empty()) undistort<Rgb8>(undistort_, color);
    return true;
  } catch (const InputError& error) {
    throw InputError(name + error.what());
  }
}

std::vector<TimedPose> Recording::ground_truth() const {
  const std::filesystem::path file = folder_ / "groundtruth.txt";
  if (!std::filesystem::exists(file)) return {};
  return read_poses(file);
}

std::optional<FrameName> parse_frame_name(const std::string& name) {
  const std::size_t hash = name.rfind('#');
  if (hash == std::string::npos) return std::nullopt;
  std::uint64_t frame = 0;
  if (!parse_count(std::string_view(name).substr(hash + 1), frame)) {
    throw InputError(name + ": what follows # is a frame's number, from 0");
  }
  return FrameName{name.substr(0, hash), static_cast<std::size_t>(frame)};
}

}  // namespace grapnel
