#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/log.h"
#include "drivers/modbus/device_identity.h"
#include "drivers/modbus/modbus_config.h"
#include "drivers/modbus/report_encoder.h"
#include "hal/plc.h"

namespace grapnel {

/// Lets the owner of the field bus thread see it live. Both are called on that thread.
struct FieldBusHooks {
  void (*thread_started)(void* context) noexcept = nullptr;  ///< by run(), before the first request
  void (*progress)(void* context) noexcept = nullptr;        ///< at least every 100 ms
  void* context = nullptr;
};

/// What the server is handed besides its configuration.
struct ModbusOptions {
  DeviceIdentity identity;
  FieldBusHooks hooks;
  LogRing* log = nullptr;       ///< refusals are told here, at most one a second
  int inherited_listener = -1;  ///< a listening socket (inherited_listener() of sockets.h), or -1
};

/// The Modbus server, TCP and RTU: the only face of the device to the PLC. One thread calls
/// everything but wake(): open(), then run() or poll_once(). After open() it calls no heap, takes
/// no lock and waits only in poll(). Behaviour and registers: docs/registers.md.
class ModbusServer {
 public:
  /// `sink` and `clock` must outlive it.
  ModbusServer(const ModbusConfig& config, PlcCommandSink& sink, const Clock& clock,
               ModbusOptions options = {});
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;
  ~ModbusServer();

  /// Opens listener and serial line. BadParameter or InternalFault when it can't; problem() then
  /// says why in one line.
  Status open();
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }
  /// TCP port, 0 without TCP.
  [[nodiscard]] std::uint16_t port() const noexcept;

  /// Serves until `stop` is true; wake() makes it look.
  void run(const std::atomic<bool>& stop) noexcept;
  /// Waits for at most `timeout_ms` (and at most 50 ms), reads the sink's status and serves what
  /// came.
  void poll_once(int timeout_ms) noexcept;
  /// Any thread: ends the wait of poll_once().
  void wake() noexcept;

  [[nodiscard]] const FieldBusCounters& counters() const noexcept;

 private:
  struct Parts;

  ModbusConfig config_;
  PlcCommandSink* sink_;
  const Clock* clock_;
  ModbusOptions options_;
  std::string problem_;
  std::unique_ptr<Parts> parts_;
};

}  // namespace grapnel
