#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>

#include "base/image.h"
#include "drivers/replay/camera_file.h"
#include "drivers/replay/recording_index.h"

namespace grapnel {

/// Writes a recording frame by frame. An index line is written only after its image is complete, so
/// that a crash costs at most the frame under way. Times must ascend within each of the three.
class RecordingWriter {
 public:
  /// Makes the folder. Throws InputError when it can't, or when it holds a recording already.
  RecordingWriter(std::filesystem::path folder, const CameraFile& camera);

  /// Each throws InputError when the file can't be written.
  void add_depth(std::int64_t time_us, ImageView<const std::uint16_t> depth);
  void add_color(std::int64_t time_us, ImageView<const Rgb8> color);
  /// Copy an encoded image as it is.
  void add_depth_file(std::int64_t time_us, const std::filesystem::path& image);
  void add_color_file(std::int64_t time_us, const std::filesystem::path& image);
  /// A line of groundtruth.txt, which is made at the first one.
  void add_pose(const TimedPose& timed);

  [[nodiscard]] std::size_t depth_images() const noexcept { return depth_images_; }
  [[nodiscard]] std::size_t color_images() const noexcept { return color_images_; }
  [[nodiscard]] const std::filesystem::path& folder() const noexcept { return folder_; }

 private:
  void begin_colors();
  void add_line(std::ofstream& stream, const char* name, const std::string& line);

  std::filesystem::path folder_;
  std::ofstream depth_index_;
  std::ofstream color_index_;
  std::ofstream poses_;
  std::size_t depth_images_ = 0;
  std::size_t color_images_ = 0;
};

}  // namespace grapnel
