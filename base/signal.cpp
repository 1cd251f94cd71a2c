#include "base/signal.h"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <climits>
#include <ctime>

namespace grapnel {

void Signal::notify() noexcept {
  version_.fetch_add(1, std::memory_order_acq_rel);
  syscall(SYS_futex, reinterpret_cast<std::uint32_t*>(&version_), FUTEX_WAKE_PRIVATE, INT_MAX,
          nullptr, nullptr, 0);
}

bool Signal::wait(std::uint32_t seen, std::int64_t timeout_us) const noexcept {
  if (version() != seen) return true;
  if (timeout_us <= 0) return false;
  timespec timeout{};
  timeout.tv_sec = timeout_us / 1'000'000;
  timeout.tv_nsec = (timeout_us % 1'000'000) * 1000;
  syscall(SYS_futex, reinterpret_cast<const std::uint32_t*>(&version_), FUTEX_WAIT_PRIVATE, seen,
          &timeout, nullptr, 0);
  return version() != seen;
}

}  // namespace grapnel
