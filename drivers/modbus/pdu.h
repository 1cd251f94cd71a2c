#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace grapnel {

inline constexpr std::size_t kMbapLength = 7;      ///< transaction, protocol, length, unit id
inline constexpr std::size_t kMaxPduLength = 253;  ///< function code and data
inline constexpr std::size_t kMaxAduLength = kMbapLength + kMaxPduLength;

/// Functions that are served.
enum class ModbusFunction : std::uint8_t {
  ReadHolding = 3,
  ReadInput = 4,
  WriteSingle = 6,
  WriteMultiple = 16,
  ReadWrite = 23,
  EncapsulatedTransport = 43,
};

/// Exception codes; None is no exception.
enum class ModbusException : std::uint8_t {
  None = 0,
  IllegalFunction = 1,  ///< not served, or write not authorised
  IllegalAddress = 2,
  IllegalValue = 3,  ///< count or structure
  DeviceFailure = 4,
  NoSuchUnit = 11,
};

inline constexpr std::uint8_t kReadDeviceIdentification = 14;  ///< MEI type of function 43

/// A request taken apart. Counts are 0 where the function has none.
struct PduRequest {
  ModbusFunction function = ModbusFunction::ReadHolding;
  std::uint16_t read_first = 0;
  std::uint16_t read_count = 0;
  std::uint16_t write_first = 0;
  std::uint16_t write_count = 0;
  std::span<const std::uint8_t> write_data;  ///< 2 × write_count bytes of the PDU

  [[nodiscard]] bool writes() const noexcept { return write_count != 0; }
};

/// Big-endian 16-bit value at `bytes[at]`.
[[nodiscard]] constexpr std::uint16_t be16(std::span<const std::uint8_t> bytes,
                                           std::size_t at) noexcept {
  return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}
constexpr void put_be16(std::span<std::uint8_t> bytes, std::size_t at,
                        std::uint16_t value) noexcept {
  bytes[at] = static_cast<std::uint8_t>(value >> 8);
  bytes[at + 1] = static_cast<std::uint8_t>(value & 0xff);
}

/// True when the PDU's length is the one its function code (and byte count) asks for. Functions
/// that are not served fit any length. `pdu` has at least one byte.
[[nodiscard]] bool pdu_length_fits(std::span<const std::uint8_t> pdu) noexcept;

/// Takes a PDU apart and checks function, structure and counts: IllegalFunction, IllegalValue or
/// None. `request` is filled when None, and only `request.function` when a served function is
/// malformed.
[[nodiscard]] ModbusException parse_request(std::span<const std::uint8_t> pdu,
                                            PduRequest& request) noexcept;

/// Checks the addresses against the register map: IllegalAddress or None.
[[nodiscard]] ModbusException check_addresses(const PduRequest& request) noexcept;

}  // namespace grapnel
