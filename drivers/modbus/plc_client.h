#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include <modbus/modbus.h>

#include "base/clock.h"
#include "base/error.h"
#include "drivers/modbus/modbus_config.h"
#include "drivers/modbus/pose_format.h"
#include "hal/plc.h"

namespace grapnel {

struct PlcClientOptions {
  std::string host = "127.0.0.1";
  int port = 502;
  int unit_id = 1;
  WordOrder word_order = WordOrder::Abcd;
  int response_timeout_ms = 1000;
  /// Function 6 only: parameters one by one, CMD_SEQ last, as small PLCs do it.
  bool single_writes = false;
  std::uint16_t heartbeat_limit_ms = 0;  ///< HB_LIMIT_MS; 0: no heartbeat
};

/// Status and result as read in one piece and decoded. Ratios, metres and radians as in hal/plc.h;
/// an object's pose means something only when `accepted`. Counters of the diagnostics block are not
/// read.
struct PlcReading {
  PlcStatus status;
  std::uint16_t result_no = 0;  ///< RES_NO, 0 = none
  PlcResult result;
  std::array<PoseRegisters, kMaxObjects> poses{};  ///< as they stand in the registers
};

/// How a command ended.
struct PlcAnswer {
  Code ack_code = Code::Ok;  ///< Accepted, or why not
  bool done = false;         ///< DONE was seen and `reading` holds the command's result
  PlcReading reading;
  std::int64_t latency_us = 0;  ///< command written → its result read
};

/// The PLC's side of the handshake, over libmodbus; for the emulator and for tests. May allocate
/// and block up to the time limits.
class PlcClient {
 public:
  explicit PlcClient(const PlcClientOptions& options);

  /// Every Error carries no text; problem() says what failed in one line.
  Status connect();
  void disconnect() noexcept;
  [[nodiscard]] const std::string& problem() const noexcept { return problem_; }

  /// Status, result and all its objects, read again until the bracketing numbers agree.
  Status read(PlcReading& reading);
  /// Writes the command with the next token and waits for the answer; with `wait_done` for DONE
  /// too. An answer that does not come in `timeout_ms` is NoFrameInTime.
  Result<PlcAnswer> run(PlcCommand command, int timeout_ms, bool wait_done);
  /// Writes the command with the next token, which it sets, and waits for nothing: read() shows
  /// what became of it.
  Status send(PlcCommand& command);
  /// Changes HB_IN when the last change is 100 ms old; run() does it while it waits. Does nothing
  /// without a heartbeat.
  Status beat_if_due();

  /// Plain access, `words` in host byte order.
  Status read_input(std::uint16_t first, std::uint16_t count, std::uint16_t* words);
  Status read_holding(std::uint16_t first, std::uint16_t count, std::uint16_t* words);
  Status write(std::uint16_t first, std::uint16_t count, const std::uint16_t* words);

 private:
  struct ContextDeleter {
    void operator()(modbus_t* context) const noexcept {
      modbus_close(context);
      modbus_free(context);
    }
  };

  Status fail(const char* what);
  Status read_further_objects(std::uint16_t result_no, PlcReading& reading, bool& whole);
  Status take_token(PlcCommand& command);
  Status write_command(const PlcCommand& command);

  PlcClientOptions options_;
  MonotonicClock clock_;
  std::unique_ptr<modbus_t, ContextDeleter> context_;
  std::uint16_t beat_ = 0;
  std::int64_t next_beat_us_ = 0;
  std::string problem_;
};

}  // namespace grapnel
