#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "drivers/replay/recording.h"
#include "drivers/replay/replay_options.h"

namespace grapnel {

/// Which frame of a recording comes n-th, and when: laps follow each other without a gap, and time
/// never runs back even where the recording's timestamps do.
class PlaybackOrder {
 public:
  /// Throws InputError when `start` or `count` lies outside the recording.
  PlaybackOrder(const Recording& recording, const ReplayOptions& options);

  /// Frames of one lap.
  [[nodiscard]] std::size_t lap_frames() const noexcept { return offsets_us_.size(); }
  /// The n-th exists: always in a loop.
  [[nodiscard]] bool has(std::uint64_t n) const noexcept { return loop_ || n < offsets_us_.size(); }
  [[nodiscard]] std::size_t frame(std::uint64_t n) const noexcept {
    return first_ + static_cast<std::size_t>(n % offsets_us_.size());
  }
  /// Recorded time since the first one, microseconds; strictly ascending in n.
  [[nodiscard]] std::int64_t offset_us(std::uint64_t n) const noexcept {
    const auto lap = static_cast<std::int64_t>(n / offsets_us_.size());
    return lap * lap_us_ + offsets_us_[static_cast<std::size_t>(n % offsets_us_.size())];
  }

 private:
  std::size_t first_ = 0;
  bool loop_ = false;
  std::int64_t lap_us_ = 0;
  std::vector<std::int64_t> offsets_us_;
};

}  // namespace grapnel
