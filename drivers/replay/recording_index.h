#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/geometry.h"

namespace grapnel {

/// A row of depth.txt or rgb.txt.
struct IndexRow {
  std::int64_t time_us = 0;
  std::string file;  ///< relative to the recording
};

/// A row of groundtruth.txt: time tx ty tz qx qy qz qw.
struct TimedPose {
  std::int64_t time_us = 0;
  Pose pose = Pose::Identity();  ///< world_from_camera, unless the recording says otherwise
};

/// Largest text file of a recording that is read.
inline constexpr std::uintmax_t kMaxIndexBytes = std::uintmax_t{1} << 26;

/// Seconds in decimal ("1305031229.528784") as whole microseconds, rounded. False when `word` is
/// anything else or out of range.
[[nodiscard]] bool parse_time(std::string_view word, std::int64_t& time_us) noexcept;
/// Microseconds as seconds with six decimals.
[[nodiscard]] std::string time_text(std::int64_t time_us);

/// Read a TUM text file: '#' begins a comment. A last line without its end that can't be read is
/// taken as a write that was cut off, and left out; so is one that names no file. Throw InputError
/// with file and line.
[[nodiscard]] std::vector<IndexRow> read_index(const std::filesystem::path& file);
[[nodiscard]] std::vector<IndexRow> parse_index(std::string_view text, const std::string& name);
[[nodiscard]] std::vector<TimedPose> read_poses(const std::filesystem::path& file);
[[nodiscard]] std::vector<TimedPose> parse_poses(std::string_view text, const std::string& name);

/// One line of groundtruth.txt, with its end.
[[nodiscard]] std::string pose_line(const TimedPose& timed);

/// The position in `times_us` (ascending) of the value nearest to `time_us`; size() when none is
/// within `limit_us`.
[[nodiscard]] std::size_t nearest_time(const std::vector<std::int64_t>& times_us,
                                       std::int64_t time_us, std::int64_t limit_us) noexcept;

}  // namespace grapnel
