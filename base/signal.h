#pragma once

#include <atomic>
#include <cstdint>

namespace grapnel {

/// Wakes threads that wait for "something changed", with a time limit and without a lock: a counter
/// and the kernel's futex on it. Take `version()`, look at the state, then wait for the next
/// version.
class Signal {
 public:
  [[nodiscard]] std::uint32_t version() const noexcept {
    return version_.load(std::memory_order_acquire);
  }
  void notify() noexcept;
  /// Returns when the version differs from `seen` or `timeout_us` real microseconds have passed;
  /// may return early. True when the version differs.
  // NOLINTNEXTLINE(modernize-use-nodiscard): who only waits looks at the state again anyway
  bool wait(std::uint32_t seen, std::int64_t timeout_us) const noexcept;

 private:
  std::atomic<std::uint32_t> version_{0};
};

}  // namespace grapnel
