#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace grapnel {

/// Newest value from one writer to one reader, without locks: a triple buffer. The writer never
/// waits; the reader sees each value whole, and only the newest. T is copied, never constructed
/// after start.
template <class T>
class Latest {
 public:
  /// Writer: the slot to fill before publish().
  [[nodiscard]] T& writable() noexcept { return slots_[back_]; }
  /// Writer: hands the filled slot over.
  void publish() noexcept {
    const std::uint32_t previous = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel);
    back_ = previous & kIndex;
  }
  void publish(const T& value) noexcept {
    writable() = value;
    publish();
  }

  /// Reader: takes over the newest value. False when nothing came since the last call; `get()` then
  /// still holds the previous one.
  bool update() noexcept {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    const std::uint32_t previous = middle_.exchange(front_, std::memory_order_acq_rel);
    front_ = previous & kIndex;
    return true;
  }
  /// Reader: the value taken over last.
  [[nodiscard]] const T& get() const noexcept { return slots_[front_]; }

 private:
  static constexpr std::uint32_t kFresh = 4;
  static constexpr std::uint32_t kIndex = 3;

  std::array<T, 3> slots_{};
  alignas(64) std::atomic<std::uint32_t> middle_{1};
  alignas(64) std::uint32_t back_ = 0;
  alignas(64) std::uint32_t front_ = 2;
};

}  // namespace grapnel
