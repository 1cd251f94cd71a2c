#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "base/depth_frame.h"
#include "drivers/replay/camera_file.h"
#include "drivers/replay/recording_store.h"

namespace grapnel {

/// An exposure as it goes to the disk: encoded images.
struct EncodedFrame {
  std::int64_t time_us = 0;  ///< of the index
  std::span<const std::byte> depth;
  std::span<const std::byte> color;  ///< empty: none
  const char* color_ending = ".png";
};

/// A recording in the TUM layout that a power cut leaves readable. Images are written at once;
/// their index lines follow with the next flush, after the images are known to be on the disk. So
/// an index never names an image that is not whole, and what is lost is what came after the last
/// flush.
class DurableRecording {
 public:
  /// Flushed twice a second, so that a flush may take half a second itself.
  static constexpr std::int64_t kFlushUs = 500'000;

  /// Writes camera.toml and the head of the index. Throws InputError.
  DurableRecording(RecordingStore& store, const CameraFile& camera);

  /// Throws InputError when the frame's images can't be written: it is then not in the recording.
  /// Times ascend.
  void add(const EncodedFrame& frame);
  /// Flushes when kFlushUs have passed since the last one. Throws InputError; the lines are kept
  /// and tried again.
  void flush_if_due(std::int64_t now_us);
  void flush();

  /// Frames whose index lines are on the disk.
  [[nodiscard]] std::uint64_t flushed() const noexcept { return flushed_; }

 private:
  void append_lines(const char* name, std::string& lines);

  RecordingStore* store_;
  std::string depth_lines_;
  std::string color_lines_;
  bool has_color_ = false;
  std::uint64_t waiting_ = 0;  // frames in depth_lines_
  std::uint64_t flushed_ = 0;
  std::optional<std::int64_t> last_flush_us_;
};

/// What camera.toml says of a camera's frames.
[[nodiscard]] CameraFile camera_file_of(const DepthFrame& frame, const std::string& serial);

}  // namespace grapnel
