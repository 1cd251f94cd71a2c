#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "drivers/modbus/pdu.h"

namespace grapnel {

/// What function 43/14 tells of the device.
struct DeviceIdentity {
  std::string vendor = "Grapnel";
  std::string product_code = "grapneld";
  std::string revision = "0.1.0";
  std::string vendor_url;
  std::string product_name = "Grapnel capture and register appliance";
  std::string model_name;
  std::string application_name;
};

/// Answers a parsed request of function 43/14 (Modbus Application Protocol V1.1b3, 6.21): the basic
/// and the regular objects, as a stream or one by one. Length of the answer PDU in `out`
/// (kMaxPduLength bytes), or 0 with the exception to send. Texts are cut at 60 bytes; what does
/// not fit in one answer is left to the next ("more follows").
[[nodiscard]] std::size_t answer_identification(std::span<const std::uint8_t> pdu,
                                                const DeviceIdentity& identity,
                                                std::span<std::uint8_t> out,
                                                ModbusException& exception) noexcept;

}  // namespace grapnel
