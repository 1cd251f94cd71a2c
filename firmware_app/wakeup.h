#pragma once

#include <cstdint>

#include <sys/eventfd.h>
#include <unistd.h>

namespace grapnel {

/// Wakes a thread that waits in poll(). notify() never blocks.
class Wakeup {
 public:
  Wakeup() : fd_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}
  Wakeup(const Wakeup&) = delete;
  Wakeup& operator=(const Wakeup&) = delete;
  ~Wakeup() { ::close(fd_); }

  void notify() noexcept {
    const std::uint64_t one = 1;
    // A full counter wakes as well.
    [[maybe_unused]] const ssize_t written = ::write(fd_, &one, sizeof one);
  }
  /// Forgets past notifications.
  void clear() noexcept {
    std::uint64_t count = 0;
    [[maybe_unused]] const ssize_t bytes = ::read(fd_, &count, sizeof count);
  }
  /// Readable after notify().
  [[nodiscard]] int descriptor() const noexcept { return fd_; }

 private:
  int fd_;
};

}  // namespace grapnel
