#pragma once

#include <cstdint>
#include <string>

namespace grapnel {

/// The service manager's notification socket (sd_notify's protocol). Does nothing where there is no
/// NOTIFY_SOCKET.
class ServiceNotifier {
 public:
  /// Reads NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID.
  ServiceNotifier();
  ServiceNotifier(const ServiceNotifier&) = delete;
  ServiceNotifier& operator=(const ServiceNotifier&) = delete;
  ~ServiceNotifier();

  /// "READY=1", "STATUS=…", "STOPPING=1"; lines are separated by '\n'.
  void send(const std::string& state) const noexcept;
  /// Time between two signs of life that the service manager asks for; 0 = none wanted.
  [[nodiscard]] std::int64_t watchdog_interval_us() const noexcept { return watchdog_us_; }

 private:
  int socket_ = -1;
  std::int64_t watchdog_us_ = 0;
};

}  // namespace grapnel
