#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/clock.h"
#include "drivers/replay/durable_recording.h"
#include "hal/frame_pool.h"

namespace grapnel {

enum class RecordColor : std::uint8_t {
  None,
  Png,   ///< lossless
  Jpeg,  ///< smaller; colour keypoints found in it differ from the live image's
};

struct RecorderOptions {
  RecordColor color = RecordColor::Png;
  int jpeg_quality = 92;
  std::string serial;                         ///< for camera.toml
  std::int64_t time_offset_us = 0;            ///< added to a frame's exposure time in the index
  std::uint64_t max_frames = 0;               ///< recorded is ended() after so many; 0 = no limit
  std::size_t queue_bytes = 64u << 20;        ///< encoded images that may wait for the disk
  std::uint64_t min_free_bytes = 256u << 20;  ///< left free on the disk for everybody else
};

/// Since start.
struct RecorderCounters {
  std::uint64_t recorded = 0;      ///< in the index on the disk
  std::uint64_t missed = 0;        ///< numbers missing in the sensor's sequence: by whatever cause
  std::uint64_t dropped_disk = 0;  ///< that could not be written: disk full, or failing
  std::uint64_t stored_plain = 0;  ///< encoded without compression to catch up
  std::uint64_t bytes = 0;         ///< of images
  std::size_t waiting_bytes = 0;   ///< encoded, not yet written
  bool failing = false;            ///< the last frame could not be written
};

/// Records what a camera publishes. One thread encodes, another writes; capture never waits for
/// either: at most one frame of the pool is leased, and what can't be kept up with is lost here and
/// counted. While the encoder lags it stores images without compression.
class FrameRecorder {
 public:
  /// `pool`, `store` and `clock` outlive the recorder.
  FrameRecorder(FramePool& pool, RecordingStore& store, const Clock& clock,
                RecorderOptions options);
  FrameRecorder(const FrameRecorder&) = delete;
  FrameRecorder& operator=(const FrameRecorder&) = delete;
  ~FrameRecorder() { stop(); }

  /// Records frames published from now on.
  void start();
  /// Records what was published before this call, writes all and ends. May be called again.
  void stop() noexcept;

  /// max_frames are encoded.
  [[nodiscard]] bool ended() const noexcept { return ended_.load(std::memory_order_acquire); }
  [[nodiscard]] RecorderCounters counters() const;
  /// Last failure in one line; "" when there was none.
  [[nodiscard]] std::string problem() const;

 private:
  struct Item {
    std::int64_t time_us = 0;
    std::vector<std::byte> depth;
    std::vector<std::byte> color;
    CameraFile camera;
    [[nodiscard]] std::size_t bytes() const { return depth.size() + color.size(); }
  };

  void encode_frames();
  void encode(const DepthFrame& frame, bool lagging);
  [[nodiscard]] bool has_room() const;
  void write_items();
  void write(const Item& item);
  void flush(bool due_only) noexcept;
  void note_problem(const char* text);

  FramePool* pool_;
  RecordingStore* store_;
  const Clock* clock_;
  const RecorderOptions options_;
  std::thread encoder_;
  std::thread writer_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> ended_{false};
  std::int64_t next_us_ = 0;                   // encoder: exposures from here on
  std::optional<std::uint64_t> last_;          // encoder: sequence of the last frame
  std::uint64_t encoded_ = 0;                  // encoder
  std::optional<DurableRecording> recording_;  // writer
  CameraFile camera_;                          // writer: of the recording

  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<Item> queue_;
  bool encoder_done_ = false;
  RecorderCounters counters_;
  std::string problem_;
};

}  // namespace grapnel
