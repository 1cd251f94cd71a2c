#pragma once

#include <array>
#include <cstdint>
#include <string>

#include <poll.h>

#include "drivers/modbus/request_handler.h"
#include "drivers/modbus/rtu_framing.h"

namespace grapnel {

/// The serial line as one peer of the control role. A line that goes away is opened again every
/// second. It loses the command block after ten seconds without a request. Never waits.
class RtuLink {
 public:
  /// `handler` must outlive it. Without `rtu_device` in the configuration it stays closed.
  RtuLink(const ModbusConfig& config, RequestHandler& handler);
  RtuLink(const RtuLink&) = delete;
  RtuLink& operator=(const RtuLink&) = delete;
  ~RtuLink();

  /// False with `problem` in one line.
  [[nodiscard]] bool open(std::string& problem);
  [[nodiscard]] pollfd poll_entry() const noexcept;
  void serve(short poll_result, std::int64_t now_us) noexcept;
  [[nodiscard]] std::int64_t deadline_us() const noexcept;

 private:
  void reopen(std::int64_t now_us) noexcept;
  void lose_line(std::int64_t now_us) noexcept;
  bool receive(std::int64_t now_us) noexcept;
  bool send_answer() noexcept;
  void answer_frame(std::int64_t now_us) noexcept;

  ModbusConfig config_;
  RequestHandler* handler_;
  std::int64_t silence_us_;
  int line_ = -1;
  RtuAssembler in_;
  std::array<std::uint8_t, kMaxRtuFrame> out_{};
  std::size_t out_begin_ = 0;
  std::size_t out_end_ = 0;
  std::int64_t frame_end_us_;
  std::int64_t owner_end_us_;
  std::int64_t reopen_us_;
};

}  // namespace grapnel
