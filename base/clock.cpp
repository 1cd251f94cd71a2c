#include "base/clock.h"

#include <cerrno>
#include <ctime>

namespace grapnel {

std::int64_t MonotonicClock::now_us() const noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000 + now.tv_nsec / 1000;
}

void MonotonicClock::sleep_until_us(std::int64_t until_us) const noexcept {
  timespec until{};
  until.tv_sec = until_us / 1'000'000;
  until.tv_nsec = (until_us % 1'000'000) * 1000;
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

void ManualClock::sleep_until_us(std::int64_t until_us) const noexcept {
  std::int64_t now = now_us_.load();
  while (now < until_us) {
    now_us_.wait(now);
    now = now_us_.load();
  }
}

void ManualClock::advance_us(std::int64_t by_us) noexcept {
  now_us_.fetch_add(by_us);
  now_us_.notify_all();
}

}  // namespace grapnel
