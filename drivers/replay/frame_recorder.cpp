#include "drivers/replay/frame_recorder.h"

#include <chrono>
#include <exception>
#include <utility>

#include "base/input_error.h"
#include "drivers/replay/image_file.h"

namespace grapnel {
namespace {

constexpr std::int64_t kLookUs = 50'000;
constexpr std::int64_t kFullLookUs = 10'000;
// Frames the encoder may be behind the camera before it stops compressing: half of the smallest
// pool, so that the rest of the pool covers the change.
constexpr std::int64_t kLagFrames = 2;

bool same_camera(const CameraFile& a, const CameraFile& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy &&
         a.cx == b.cx && a.cy == b.cy && a.metres_per_unit == b.metres_per_unit;
}

}  // namespace

FrameRecorder::FrameRecorder(FramePool& pool, RecordingStore& store, const Clock& clock,
                             RecorderOptions options)
    : pool_(&pool), store_(&store), clock_(&clock), options_(std::move(options)) {}

void FrameRecorder::start() {
  if (encoder_.joinable()) return;
  {
    const FrameLease newest = pool_->lease_latest();
    if (newest.valid()) next_us_ = newest.frame().exposure_us + 1;
  }
  writer_ = std::thread([this] { write_items(); });
  encoder_ = std::thread([this] { encode_frames(); });
}

void FrameRecorder::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  if (encoder_.joinable()) encoder_.join();
  {
    const std::lock_guard lock(mutex_);
    encoder_done_ = true;
  }
  arrived_.notify_one();
  if (writer_.joinable()) writer_.join();
}

RecorderCounters FrameRecorder::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

std::string FrameRecorder::problem() const {
  const std::lock_guard lock(mutex_);
  return problem_;
}

void FrameRecorder::note_problem(const char* text) {
  const std::lock_guard lock(mutex_);
  problem_ = text;
}

bool FrameRecorder::has_room() const {
  const std::lock_guard lock(mutex_);
  return counters_.waiting_bytes < options_.queue_bytes;
}

void FrameRecorder::encode_frames() {
  std::optional<std::int64_t> end_us;  // set when stopping: what was there by then is still taken
  while (!ended_.load(std::memory_order_relaxed)) {
    if (!end_us && stop_.load(std::memory_order_acquire)) {
      const FrameLease newest = pool_->lease_latest();
      end_us = newest.valid() ? newest.frame().exposure_us : 0;
    }
    if (!has_room()) {
      clock_->sleep_until_us(clock_->now_us() + kFullLookUs);
      continue;
    }
    const std::uint32_t seen = pool_->published_signal().version();
    const FrameLease lease = pool_->lease_first_since(next_us_);
    if (!lease.valid() || (end_us && lease.frame().exposure_us > *end_us)) {
      if (end_us) return;
      pool_->published_signal().wait(seen, kLookUs);
      continue;
    }
    const FrameLease newest = pool_->lease_latest();
    const auto distance = static_cast<std::int64_t>(newest.frame().sequence) -
                          static_cast<std::int64_t>(lease.frame().sequence);
    encode(lease.frame(), distance > kLagFrames);
  }
}

void FrameRecorder::encode(const DepthFrame& frame, bool lagging) {
  next_us_ = frame.exposure_us + 1;
  const PngEffort effort = lagging ? PngEffort::None : PngEffort::Fast;
  Item item;
  item.time_us = frame.exposure_us + options_.time_offset_us;
  item.camera = camera_file_of(frame, options_.serial);
  bool failed = false;
  try {
    item.depth = encode_depth_png(frame.depth, effort);
    if (!frame.color.empty() && options_.color == RecordColor::Png) {
      item.color = encode_color_png(frame.color, effort);
    } else if (!frame.color.empty() && options_.color == RecordColor::Jpeg) {
      item.color = encode_color_jpeg(frame.color, options_.jpeg_quality);
    }
  } catch (const std::exception& error) {
    note_problem(error.what());
    failed = true;
  }
  {
    const std::lock_guard lock(mutex_);
    const bool gap = last_ && frame.sequence > *last_ + 1;
    if (gap) counters_.missed += frame.sequence - *last_ - 1;
    if (failed) {
      ++counters_.dropped_disk;
    } else {
      if (lagging) ++counters_.stored_plain;
      counters_.waiting_bytes += item.bytes();
      queue_.push_back(std::move(item));
    }
  }
  last_ = frame.sequence;
  arrived_.notify_one();
  if (++encoded_ == options_.max_frames) ended_.store(true, std::memory_order_release);
}

void FrameRecorder::write_items() {
  for (;;) {
    std::optional<Item> item;
    {
      std::unique_lock lock(mutex_);
      arrived_.wait_for(lock, std::chrono::microseconds(kLookUs),
                        [this] { return !queue_.empty() || encoder_done_; });
      if (!queue_.empty()) {
        item = std::move(queue_.front());
        queue_.pop_front();
      } else if (encoder_done_) {
        break;
      }
    }
    if (item) write(*item);
    flush(true);
  }
  flush(false);
}

void FrameRecorder::write(const Item& item) {
  bool written = false;
  try {
    if (store_->free_bytes() < options_.min_free_bytes) {
      throw InputError("disk full: less than " + std::to_string(options_.min_free_bytes >> 20) +
                       " MiB are free");
    }
    if (!recording_) {
      recording_.emplace(*store_, item.camera);
      camera_ = item.camera;
    }
    if (!same_camera(camera_, item.camera)) {
      throw InputError("the camera's size, unit or intrinsics changed; a new recording is needed");
    }
    const char* ending = options_.color == RecordColor::Jpeg ? ".jpg" : ".png";
    recording_->add({item.time_us, item.depth, item.color, ending});
    written = true;
  } catch (const std::exception& error) {
    note_problem(error.what());
  }
  const std::lock_guard lock(mutex_);
  counters_.waiting_bytes -= item.bytes();
  counters_.failing = !written;
  if (written) {
    counters_.bytes += item.bytes();
  } else {
    ++counters_.dropped_disk;
  }
}

void FrameRecorder::flush(bool due_only) noexcept {
  if (!recording_) return;
  try {
    if (due_only) {
      recording_->flush_if_due(clock_->now_us());
    } else {
      recording_->flush();
    }
  } catch (const std::exception& error) {
    note_problem(error.what());
  }
  const std::lock_guard lock(mutex_);
  counters_.recorded = recording_->flushed();
}

}  // namespace grapnel
