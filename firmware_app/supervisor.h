#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace grapnel {

/// Threads whose progress the heartbeat and the watchdog stand for.
enum class Supervised : std::uint8_t { Capture, Registration, FieldBus, kCount };

/// Watches the progress counters of all supervised threads. The heartbeat goes on only while every
/// one of them has moved lately; a timer alone never feeds it.
class Supervisor {
 public:
  /// A thread that has not moved for this long is not alive. Above the longest single step of a
  /// job: the pipeline shows a sign of life at every stage boundary.
  static constexpr std::int64_t kSilenceLimitUs = 500'000;

  /// Any thread: what the supervised thread counts up.
  [[nodiscard]] std::atomic<std::uint64_t>& progress(Supervised thread) noexcept {
    return rows_[static_cast<std::size_t>(thread)].progress;
  }
  /// Any thread: whether the thread is meant to run now (a camera that is not open has none).
  void expect(Supervised thread, bool running) noexcept {
    rows_[static_cast<std::size_t>(thread)].expected.store(running, std::memory_order_release);
  }

  /// Housekeeping, every 100 ms: true when every expected thread has moved within the limit.
  [[nodiscard]] bool alive(std::int64_t now_us) noexcept;
  /// Housekeeping: the first thread found silent by the last alive(), kCount when none.
  [[nodiscard]] Supervised silent() const noexcept { return silent_; }

 private:
  struct Row {
    std::atomic<std::uint64_t> progress{0};
    std::atomic<bool> expected{false};
    std::uint64_t seen = 0;
    std::int64_t moved_us = 0;
    bool was_expected = false;
  };
  std::array<Row, static_cast<std::size_t>(Supervised::kCount)> rows_;
  Supervised silent_ = Supervised::kCount;
};

}  // namespace grapnel
