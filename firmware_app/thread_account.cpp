#include "firmware_app/thread_account.h"

#include <sys/resource.h>

namespace grapnel {

thread_local std::atomic<std::uint64_t>* t_heap_calls = nullptr;
std::atomic<bool> g_heap_interposed{false};

void ThreadAccount::attach() noexcept { t_heap_calls = &calls_; }

void ThreadAccount::sample() noexcept {
  rusage usage{};
  if (getrusage(RUSAGE_THREAD, &usage) != 0) return;
  const auto faults = static_cast<std::uint64_t>(usage.ru_minflt + usage.ru_majflt);
  const std::uint64_t calls = calls_.load(std::memory_order_relaxed);
  if (restart_.exchange(false, std::memory_order_acq_rel)) {
    counting_ = true;
    calls_base_ = calls;
    faults_base_ = faults;
  }
  if (!counting_) return;
  heap_.store(static_cast<std::uint32_t>(calls - calls_base_), std::memory_order_relaxed);
  faults_.store(static_cast<std::uint32_t>(faults - faults_base_), std::memory_order_relaxed);
}

}  // namespace grapnel
