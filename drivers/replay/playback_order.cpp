#include "drivers/replay/playback_order.h"

#include <algorithm>
#include <string>

#include "base/input_error.h"

namespace grapnel {

PlaybackOrder::PlaybackOrder(const Recording& recording, const ReplayOptions& options)
    : first_(static_cast<std::size_t>(options.start)), loop_(options.loop) {
  const std::size_t frames = recording.frame_count();
  if (first_ >= frames) {
    throw InputError(recording.folder().string() + ": start " + std::to_string(first_) +
                     " is not allowed; the recording's frames are 0 to " +
                     std::to_string(frames - 1));
  }
  std::size_t count = frames - first_;
  if (options.count > 0) count = std::min(count, static_cast<std::size_t>(options.count));
  std::int64_t offset_us = -1;
  for (std::size_t i = first_; i < first_ + count; ++i) {
    offset_us = std::max(offset_us + 1, recording.time_us(i) - recording.time_us(first_));
    offsets_us_.push_back(offset_us);
  }
  lap_us_ = offset_us + recording.interval_us();
}

}  // namespace grapnel
