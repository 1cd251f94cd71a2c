#include <algorithm>
#include <string_view>

#include "base/file.h"
#include "base/formats/text_scanner.h"
#include "base/input_error.h"
#include "workbench/import/known_cameras.h"
#include "workbench/import/source.h"

namespace grapnel {
namespace {

// Poses a little before and after the frames still interpolate to them.
constexpr std::int64_t kPoseMargin_us = 1'000'000;

std::string comments_of(const std::filesystem::path& index) {
  const std::vector<std::byte> bytes = read_file(index, kMaxIndexBytes);
  TextScanner scanner({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, index.string());
  std::string comments;
  std::string_view line;
  while (scanner.next_line(line) && line.starts_with('#')) comments += line;
  return comments;
}

/// The rows of an index whose image is there; the others are counted.
std::vector<IndexRow> present_rows(const std::filesystem::path& folder, const char* index,
                                   std::size_t& absent) {
  // Somebody else's index: a last line without its end is as good as the others.
  const std::filesystem::path file = folder / index;
  const std::vector<std::byte> bytes = read_file(file, kMaxIndexBytes);
  std::vector<IndexRow> rows =
      parse_index({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, file.string());
  std::vector<IndexRow> present;
  for (IndexRow& row : rows) {
    if (std::filesystem::exists(folder / row.file)) {
      present.push_back(std::move(row));
    } else {
      ++absent;
    }
  }
  return present;
}

void sort_by_time(std::vector<IndexRow>& rows) {
  std::stable_sort(rows.begin(), rows.end(),
                   [](const IndexRow& a, const IndexRow& b) { return a.time_us < b.time_us; });
}

/// Key frames listed by number: row k of the trajectory has the time and pose of image k.
void take_keyframe_times(const std::filesystem::path& trajectory, std::vector<IndexRow>& depth,
                         std::vector<IndexRow>& color, Source& source) {
  const std::vector<TimedPose> poses = read_poses(trajectory);
  for (std::vector<IndexRow>* rows : {&depth, &color}) {
    for (IndexRow& row : *rows) {
      const auto number = static_cast<std::size_t>(row.time_us / 1'000'000);
      if (number >= poses.size()) {
        throw InputError(trajectory.string() + ": has no row for image " + std::to_string(number));
      }
      row.time_us = poses[number].time_us;
      if (rows == &depth) source.poses.push_back(poses[number]);
    }
  }
  source.layout = "TUM RGB-D key frames";
}

void take_trajectory(const std::filesystem::path& trajectory, const std::vector<IndexRow>& depth,
                     Source& source) {
  if (!std::filesystem::exists(trajectory) || depth.empty()) return;
  for (const TimedPose& timed : read_poses(trajectory)) {
    if (timed.time_us < depth.front().time_us - kPoseMargin_us) continue;
    if (timed.time_us > depth.back().time_us + kPoseMargin_us) continue;
    source.poses.push_back(timed);
  }
}

void take_camera(const std::filesystem::path& folder, Source& source) {
  if (std::filesystem::exists(folder / "camera.toml")) {
    source.camera = read_camera_file(folder / "camera.toml");
    source.camera_origin = "the source's camera.toml";
    return;
  }
  const std::optional<KnownCamera> known =
      known_camera(comments_of(folder / "depth.txt") + folder.string());
  if (!known) return;
  source.camera = known->camera;
  source.camera_origin = known->origin;
}

}  // namespace

std::optional<Source> find_tum(const std::filesystem::path& folder, const SourceOptions&) {
  if (!std::filesystem::exists(folder / "depth.txt")) return std::nullopt;
  Source source;
  source.layout = "TUM RGB-D";
  std::vector<IndexRow> depth = present_rows(folder, "depth.txt", source.left_out);
  std::vector<IndexRow> color;
  std::size_t colors_absent = 0;
  if (std::filesystem::exists(folder / "rgb.txt")) {
    color = present_rows(folder, "rgb.txt", colors_absent);
  }
  sort_by_time(depth);
  sort_by_time(color);
  const std::filesystem::path keyframes = folder / "truth_cam_poses.txt";
  if (std::filesystem::exists(keyframes)) {
    take_keyframe_times(keyframes, depth, color, source);
  } else {
    take_trajectory(folder / "groundtruth.txt", depth, source);
  }
  take_camera(folder, source);
  for (const IndexRow& row : depth) source.frames.push_back({row.time_us, folder / row.file, {}});
  for (const IndexRow& row : color) source.colors.push_back({row.time_us, {}, folder / row.file});
  for (const char* name : {"accelerometer.txt", "truth_objects.txt", "objects.txt"}) {
    if (std::filesystem::exists(folder / name)) source.side_files.push_back(folder / name);
  }
  return source;
}

}  // namespace grapnel
