#include "base/log.h"

namespace grapnel {

LogRing::LogRing(const Clock& clock) noexcept : clock_(&clock) {
  for (std::size_t i = 0; i < kCapacity; ++i) cells_[i].turn.store(i, std::memory_order_relaxed);
}

void LogRing::push(LogLevel level, Stage stage, Code code, const char* text, std::int64_t a,
                   std::int64_t b, std::int64_t c) noexcept {
  std::size_t head = head_.load(std::memory_order_relaxed);
  for (;;) {
    Cell& cell = cells_[head % kCapacity];
    const std::size_t turn = cell.turn.load(std::memory_order_acquire);
    if (turn == head) {
      if (!head_.compare_exchange_weak(head, head + 1, std::memory_order_relaxed)) continue;
      cell.event = {clock_->now_us(), text, {a, b, c}, code, stage, level};
      cell.turn.store(head + 1, std::memory_order_release);
      return;
    }
    if (turn < head) {
      lost_.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    head = head_.load(std::memory_order_relaxed);
  }
}

bool LogRing::pop(LogEvent& event) noexcept {
  Cell& cell = cells_[tail_ % kCapacity];
  if (cell.turn.load(std::memory_order_acquire) != tail_ + 1) return false;
  event = cell.event;
  cell.turn.store(tail_ + kCapacity, std::memory_order_release);
  ++tail_;
  return true;
}

}  // namespace grapnel
