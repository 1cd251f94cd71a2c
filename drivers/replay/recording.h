#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/image.h"
#include "drivers/replay/camera_file.h"
#include "drivers/replay/depth_correction.h"
#include "drivers/replay/recording_index.h"

namespace grapnel {

/// A recording in the TUM RGB-D layout with camera.toml. Holds its index, not its images; reading a
/// frame decodes it anew, and allocates.
class Recording {
 public:
  /// Reads camera.toml and the index. Without depth.txt the index is rebuilt from the images' names
  /// (seconds). Throws InputError, also when there is no frame.
  [[nodiscard]] static Recording open(const std::filesystem::path& folder);

  [[nodiscard]] const CameraFile& camera() const noexcept { return camera_; }
  [[nodiscard]] const std::filesystem::path& folder() const noexcept { return folder_; }
  [[nodiscard]] std::size_t frame_count() const noexcept { return frames_.size(); }
  [[nodiscard]] std::int64_t time_us(std::size_t frame) const noexcept {
    return frames_[frame].time_us;
  }
  /// Any frame has a colour image.
  [[nodiscard]] bool has_color() const noexcept { return has_color_; }
  [[nodiscard]] bool has_color(std::size_t frame) const noexcept {
    return !frames_[frame].color_file.empty();
  }
  [[nodiscard]] bool index_rebuilt() const noexcept { return index_rebuilt_; }
  /// Middle one of the times from frame to frame; 1/30 s for a single frame.
  [[nodiscard]] std::int64_t interval_us() const noexcept { return interval_us_; }

  /// Decodes frame `frame` into buffers of width × height pixels: counts that mean "no reading"
  /// become 0, and what camera.toml says of lens and depth is corrected. `color` may be empty: then
  /// it is not read. True when the colour was filled. Throws InputError naming the frame and its
  /// file.
  // NOLINTNEXTLINE(modernize-use-nodiscard): a caller without use for colour need not ask
  bool read_frame(std::size_t frame, std::span<std::uint16_t> depth, std::span<Rgb8> color) const;

  /// groundtruth.txt; empty when there is none. Throws InputError.
  [[nodiscard]] std::vector<TimedPose> ground_truth() const;

 private:
  struct Frame {
    std::int64_t time_us = 0;
    std::string depth_file;
    std::string color_file;  // empty: none within kColorLimit_us
  };
  Recording() = default;
  void pair_colors();
  void measure_interval();

  std::filesystem::path folder_;
  CameraFile camera_;
  std::vector<Frame> frames_;
  DepthCorrection correction_;
  std::vector<std::uint32_t> undistort_;  // source pixel of each pixel; empty: as it is
  std::int64_t interval_us_ = 0;
  bool has_color_ = false;
  bool index_rebuilt_ = false;
};

/// Depth and colour of at most this distance in time belong together (half a period at 25 Hz, as in
/// TUM's own association).
inline constexpr std::int64_t kColorLimit_us = 20'000;

/// "FOLDER#7" as folder and frame number; empty when there is no '#'. Throws InputError when what
/// follows '#' is no number.
struct FrameName {
  std::filesystem::path folder;
  std::size_t frame = 0;
};
[[nodiscard]] std::optional<FrameName> parse_frame_name(const std::string& name);

}  // namespace grapnel
