#pragma once

#include <atomic>
#include <cstdint>

namespace grapnel {

/// Monotonic time in microseconds. Everything that waits or stamps is handed one, so that tests
/// turn it by hand.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual std::int64_t now_us() const noexcept = 0;
  /// Returns when now_us() has reached `until_us` (or, for a hand-turned clock, when it was turned
  /// there).
  virtual void sleep_until_us(std::int64_t until_us) const noexcept = 0;
};

/// CLOCK_MONOTONIC.
class MonotonicClock final : public Clock {
 public:
  [[nodiscard]] std::int64_t now_us() const noexcept override;
  void sleep_until_us(std::int64_t until_us) const noexcept override;
};

/// Stands still until it is turned. Safe to turn from another thread; sleepers wake when it passes
/// them.
class ManualClock final : public Clock {
 public:
  explicit ManualClock(std::int64_t start_us = 0) noexcept : now_us_(start_us) {}
  [[nodiscard]] std::int64_t now_us() const noexcept override { return now_us_.load(); }
  void sleep_until_us(std::int64_t until_us) const noexcept override;
  void advance_us(std::int64_t by_us) noexcept;

 private:
  std::atomic<std::int64_t> now_us_;
};

}  // namespace grapnel
