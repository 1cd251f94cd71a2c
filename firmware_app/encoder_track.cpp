#include "firmware_app/encoder_track.h"

#include <algorithm>

namespace grapnel {

void EncoderTrack::add(std::uint32_t count, std::int64_t now_us) noexcept {
  if (held_ > 0) {
    const Sample& last = ring_[(next_ + ring_.size() - 1) % ring_.size()];
    if (now_us - last.time_us < kShortestGapUs) return;
  }
  ring_[next_] = {now_us, count};
  next_ = (next_ + 1) % ring_.size();
  held_ = std::min(held_ + 1, ring_.size());
}

std::optional<std::uint32_t> EncoderTrack::at(std::int64_t time_us) const noexcept {
  for (std::size_t age = 1; age < held_; ++age) {
    const Sample& after = ring_[(next_ + ring_.size() - age) % ring_.size()];
    const Sample& before = ring_[(next_ + ring_.size() - age - 1) % ring_.size()];
    if (time_us > after.time_us) return std::nullopt;
    if (time_us < before.time_us) continue;
    const std::int64_t gap_us = after.time_us - before.time_us;
    if (gap_us > kLongestGapUs) return std::nullopt;
    // Of two counts so close in time the nearer way round is the way the belt went.
    const auto moved = static_cast<std::int32_t>(after.count - before.count);
    const std::int64_t part = moved * (time_us - before.time_us) / gap_us;
    return before.count + static_cast<std::uint32_t>(part);
  }
  return std::nullopt;
}

}  // namespace grapnel
