#pragma once

#include <atomic>
#include <cstdint>

namespace grapnel {

/// Where the heap interposer counts the calls of the thread it runs on; nullptr = not counted. Set
/// by ThreadAccount::attach(), read by the interposer alone.
extern thread_local std::atomic<std::uint64_t>* t_heap_calls;

/// Set by the interposer when it is linked in: without it heap calls are not counted.
extern std::atomic<bool> g_heap_interposed;

/// Counts the heap calls and page faults of one real-time thread since READY. Both must stay 0.
class ThreadAccount {
 public:
  /// On the thread itself, first thing.
  void attach() noexcept;
  /// On the thread itself, now and then: reads the kernel's count of page faults.
  void sample() noexcept;
  /// Any thread: counting starts anew with the thread's next sample().
  void restart() noexcept { restart_.store(true, std::memory_order_release); }

  [[nodiscard]] std::uint32_t heap_calls() const noexcept {
    return heap_.load(std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint32_t page_faults() const noexcept {
    return faults_.load(std::memory_order_relaxed);
  }

 private:
  std::atomic<std::uint64_t> calls_{0};  // ever, by the interposer
  std::atomic<bool> restart_{false};
  std::uint64_t calls_base_ = 0;
  std::uint64_t faults_base_ = 0;
  bool counting_ = false;
  std::atomic<std::uint32_t> heap_{0};
  std::atomic<std::uint32_t> faults_{0};
};

}  // namespace grapnel
