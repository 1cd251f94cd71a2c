#include "firmware_app/supervisor.h"

namespace grapnel {

bool Supervisor::alive(std::int64_t now_us) noexcept {
  silent_ = Supervised::kCount;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    Row& row = rows_[i];
    const bool expected = row.expected.load(std::memory_order_acquire);
    const std::uint64_t progress = row.progress.load(std::memory_order_relaxed);
    if (progress != row.seen || (expected && !row.was_expected)) row.moved_us = now_us;
    row.seen = progress;
    row.was_expected = expected;
    if (expected && now_us - row.moved_us >= kSilenceLimitUs && silent_ == Supervised::kCount) {
      silent_ = static_cast<Supervised>(i);
    }
  }
  return silent_ == Supervised::kCount;
}

}  // namespace grapnel
