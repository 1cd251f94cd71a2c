#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace grapnel {

enum class Finding : std::uint8_t { Well, Warning, Bad };

/// What one look at the machine found.
struct Diagnosis {
  std::string subject;  ///< "memory lock"
  Finding finding = Finding::Well;
  std::string cause;  ///< what was found, in one sentence without full stop
  std::string cure;   ///< what to do; "" when all is well
};

/// Where the kernel shows its devices; tests have their own.
struct SystemRoots {
  std::filesystem::path usb_devices = "/sys/bus/usb/devices";
  std::filesystem::path usb_nodes = "/dev/bus/usb";
  std::filesystem::path clock_source =
      "/sys/devices/system/clocksource/clocksource0/current_clocksource";
};

/// Depth cameras on USB: are they there, how fast is their link, do two share a host controller,
/// may this user open them, do they suspend.
[[nodiscard]] std::vector<Diagnosis> check_usb(const SystemRoots& roots);
/// SCHED_FIFO at `priority`, tried out on this thread and taken back.
[[nodiscard]] Diagnosis check_realtime(int priority);
/// Locking `bytes` of memory.
[[nodiscard]] Diagnosis check_memory_lock(std::uint64_t bytes);
/// The folder can be written and has room.
[[nodiscard]] Diagnosis check_disk(const std::filesystem::path& folder);
[[nodiscard]] Diagnosis check_clock(const SystemRoots& roots);
/// Somebody answers at the address, or the port is free for the daemon.
[[nodiscard]] Diagnosis check_modbus(const std::string& address, int port);

}  // namespace grapnel
