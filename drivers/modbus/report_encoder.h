#pragma once

#include <cstdint>

#include "drivers/modbus/register_image.h"
#include "hal/plc.h"

namespace grapnel {

/// What the field bus counts by itself, since open().
struct FieldBusCounters {
  std::uint32_t clients = 0;  ///< TCP connections now
  std::uint32_t connections_refused = 0;
  std::uint32_t requests_refused = 0;  ///< writes of peers that may not write
  std::uint32_t exceptions_sent = 0;
  std::uint32_t bytes_discarded = 0;  ///< received, but part of no valid request
  std::uint32_t requests = 0;         ///< valid framing, answered or broadcast
};

/// RES_NO of a result number: 1…65535, then 1 again; 0 only for none.
[[nodiscard]] std::uint16_t result_register(std::uint64_t result_no) noexcept;

/// Status block. `flags` and `ack_seq` are those to show, status.flags and status.ack_seq are not
/// used.
void encode_status(const PlcStatus& status, std::uint16_t flags, std::uint16_t ack_seq,
                   RegisterImage& image) noexcept;

void encode_diagnostics(const PlcDiagnostics& diagnostics, const FieldBusCounters& counters,
                        RegisterImage& image) noexcept;

/// Result block, further objects and float mirror. Without `valid`, and in every record that was
/// not accepted, poses read kNoPose and NaN. `result_no` 0: no result; `result` is then not used.
void encode_result(const PlcResult& result, std::uint64_t result_no, bool valid,
                   RegisterImage& image) noexcept;

/// The probe's constants and its counter.
void encode_probe(std::uint32_t counter, RegisterImage& image) noexcept;

}  // namespace grapnel
