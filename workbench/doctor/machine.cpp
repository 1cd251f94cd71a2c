#include <arpa/inet.h>
#include <netinet/in.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/statvfs.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>

#include "workbench/doctor/checks.h"

namespace grapnel {
namespace {

// Snapshots, logs and a minute of recording.
constexpr std::uint64_t kWantedDiskBytes = std::uint64_t{1} << 30;
constexpr time_t kAnswerLimitS = 2;

std::string mebibytes(std::uint64_t bytes) { return std::to_string(bytes >> 20) + " MiB"; }

/// Closes at the end of the scope.
class Socket {
 public:
  Socket() : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {}
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int get() const noexcept { return fd_; }

 private:
  int fd_;
};

}  // namespace

Diagnosis check_realtime(int priority) {
  if (priority == 0) return {"real-time rights", Finding::Well, "none are asked for", ""};
  int policy = 0;
  sched_param before{};
  pthread_getschedparam(pthread_self(), &policy, &before);
  sched_param wanted{};
  wanted.sched_priority = priority;
  const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted);
  const std::string what = "SCHED_FIFO priority " + std::to_string(priority);
  if (error == 0) {
    pthread_setschedparam(pthread_self(), policy, &before);
    return {"real-time rights", Finding::Well, what + " is granted", ""};
  }
  return {"real-time rights", Finding::Warning, what + " is refused: " + std::strerror(error),
          "run under the systemd unit, which has LimitRTPRIO, or raise rtprio in limits.conf"};
}

Diagnosis check_memory_lock(std::uint64_t bytes) {
  void* const block = ::mmap(nullptr, static_cast<std::size_t>(bytes), PROT_READ | PROT_WRITE,
                             MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  const bool mapped = block != MAP_FAILED;
  const bool locked = mapped && ::mlock(block, static_cast<std::size_t>(bytes)) == 0;
  const int error = errno;
  if (mapped) ::munmap(block, static_cast<std::size_t>(bytes));
  if (locked) return {"memory lock", Finding::Well, mebibytes(bytes) + " can be locked", ""};
  return {"memory lock", Finding::Warning,
          mebibytes(bytes) + " can't be locked: " + std::strerror(error),
          "run under the systemd unit, which has LimitMEMLOCK, or raise memlock in limits.conf"};
}

Diagnosis check_disk(const std::filesystem::path& folder) {
  struct statvfs space {};
  if (::statvfs(folder.c_str(), &space) != 0) {
    return {"disk", Finding::Bad, folder.string() + ": " + std::strerror(errno),
            "make the folder, or correct state.folder"};
  }
  if (::access(folder.c_str(), W_OK | X_OK) != 0) {
    return {"disk", Finding::Bad, folder.string() + " can't be written by this user",
            "give the folder to the daemon's user; is the disk mounted read-only?"};
  }
  const std::uint64_t free_bytes = static_cast<std::uint64_t>(space.f_bavail) * space.f_frsize;
  const std::string found = folder.string() + " has " + mebibytes(free_bytes) + " free";
  if (free_bytes >= kWantedDiskBytes) return {"disk", Finding::Well, found, ""};
  return {"disk", Finding::Warning, found, "delete recordings and old logs, or a larger disk"};
}

Diagnosis check_clock(const SystemRoots& roots) {
  std::ifstream stream(roots.clock_source);
  std::string source;
  stream >> source;
  if (source == "jiffies" || source == "refined-jiffies") {
    return {"clock", Finding::Bad, "the kernel counts time in ticks (" + source + ")",
            "choose tsc or hpet as clocksource on the kernel's command line"};
  }
  timespec step{};
  ::clock_getres(CLOCK_MONOTONIC, &step);
  constexpr long kWantedNs = 1000;
  if (step.tv_sec != 0 || step.tv_nsec > kWantedNs) {
    return {"clock", Finding::Bad, "the monotonic clock's step is longer than a microsecond",
            "a kernel with high-resolution timers"};
  }
  return {"clock", Finding::Well, "monotonic, source " + (source.empty() ? "unknown" : source), ""};
}

Diagnosis check_modbus(const std::string& address, int port) {
  const std::string place = address + ":" + std::to_string(port);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  const bool everywhere = address.empty() || address == "0.0.0.0";
  if (::inet_pton(AF_INET, everywhere ? "127.0.0.1" : address.c_str(), &to.sin_addr) != 1) {
    return {"Modbus", Finding::Bad, place + " is no IPv4 address",
            "correct fieldbus.listen_address"};
  }
  const Socket caller;
  const timeval limit{kAnswerLimitS, 0};
  ::setsockopt(caller.get(), SOL_SOCKET, SO_SNDTIMEO, &limit, sizeof limit);
  const auto* const peer = reinterpret_cast<const sockaddr*>(&to);
  if (::connect(caller.get(), peer, sizeof to) == 0) {
    return {"Modbus", Finding::Well, place + " takes connections", ""};
  }
  const Socket listener;
  const int yes = 1;
  ::setsockopt(listener.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (::bind(listener.get(), peer, sizeof to) == 0) {
    return {"Modbus", Finding::Warning, "nobody listens at " + place,
            "start the daemon: systemctl start grapneld"};
  }
  const int error = errno;
  const char* cure = "correct fieldbus.listen_address: it must be an address of this machine";
  if (error == EACCES) cure = "a port of 1024 or more, or the systemd socket for port 502";
  return {"Modbus", Finding::Bad, place + " can't be used: " + std::strerror(error), cure};
}

}  // namespace grapnel
