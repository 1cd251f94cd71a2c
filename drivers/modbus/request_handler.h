#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "drivers/modbus/command_block.h"
#include "drivers/modbus/device_identity.h"
#include "drivers/modbus/modbus_config.h"
#include "drivers/modbus/pdu_engine.h"
#include "drivers/modbus/peer_table.h"
#include "drivers/modbus/report_encoder.h"

namespace grapnel {

/// Who asks.
struct Peer {
  PeerId id = kNoPeer;
  PeerRole role = PeerRole::Refused;
  bool any_unit = false;  ///< its unit id is checked already
};

/// Everything between a complete telegram and its answer, whatever line it came by. Owner of the
/// register image: between two requests it takes over the sink's newest status and result, so that
/// no answer is ever torn. One thread; no heap after open().
class RequestHandler {
 public:
  /// `sink` must outlive it. `start_us` is when the probe's counter is 0.
  RequestHandler(const ModbusConfig& config, const DeviceIdentity& identity, PlcCommandSink& sink);

  /// Error detail: errno.
  Status open(std::int64_t now_us);

  /// Answers one complete request in MBAP framing, whose length field fits. Length of the answer in
  /// `out` (kMaxAduLength bytes), never 0.
  [[nodiscard]] std::size_t answer(const Peer& peer, std::span<const std::uint8_t> adu,
                                   std::span<std::uint8_t> out, std::int64_t now_us) noexcept;

  /// Takes over the newest status and result. answer() does it by itself.
  void refresh(std::int64_t now_us) noexcept;

  [[nodiscard]] CommandBlock& command_block() noexcept { return command_block_; }
  [[nodiscard]] FieldBusCounters& counters() noexcept { return counters_; }
  [[nodiscard]] const RegisterImage& image() const noexcept { return image_; }

 private:
  ModbusException check(const Peer& peer, std::span<const std::uint8_t> adu,
                        PduRequest& request) noexcept;
  std::size_t serve(const PduRequest& request, std::span<const std::uint8_t> adu,
                    std::span<std::uint8_t> out, std::int64_t now_us) noexcept;
  std::size_t write_then_read(const PduRequest& request, std::span<const std::uint8_t> adu,
                              std::span<std::uint8_t> out, std::int64_t now_us) noexcept;
  std::size_t identify(std::span<const std::uint8_t> adu, std::span<std::uint8_t> out) noexcept;
  std::size_t refuse(std::span<const std::uint8_t> adu, ModbusException exception,
                     std::span<std::uint8_t> out) noexcept;
  void after_write(const PduRequest& request, std::int64_t now_us) noexcept;

  RegisterImage image_;
  DeviceIdentity identity_;
  PlcCommandSink* sink_;
  CommandBlock command_block_;
  PduEngine engine_;
  std::array<bool, 256> unit_known_{};
  bool strict_unit_;
  std::int64_t start_us_ = 0;
  FieldBusCounters counters_;
  PlcStatus status_;
  PlcResult result_;
  std::uint64_t shown_result_no_ = 0;
  bool shown_valid_ = false;
};

}  // namespace grapnel
