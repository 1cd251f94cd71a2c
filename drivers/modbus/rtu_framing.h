#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/modbus/pdu.h"

namespace grapnel {

inline constexpr std::size_t kMaxRtuFrame = 256;  ///< slave id, PDU, CRC

/// CRC-16/MODBUS (polynomial 0xA001 reflected, start 0xFFFF); its low byte travels first.
[[nodiscard]] std::uint16_t crc16_modbus(std::span<const std::uint8_t> bytes) noexcept;

/// Silence that ends a frame: 3.5 characters of 11 bits, and 1750 us above 19200 baud (Modbus over
/// Serial Line V1.02, 2.5.1.1).
[[nodiscard]] std::int64_t rtu_silence_us(int baud) noexcept;

/// Collects the bytes of a serial line; silence ends a frame, whatever came before it.
class RtuAssembler {
 public:
  /// What is longer than a frame can be is dropped as a whole at the next silence.
  void received(std::span<const std::uint8_t> bytes) noexcept;
  /// The frame that the silence ended, without its CRC (slave id and PDU); empty when it was not
  /// one. Starts the next.
  [[nodiscard]] std::span<const std::uint8_t> end_frame() noexcept;
  /// Bytes of the frame that is being received.
  [[nodiscard]] std::size_t size() const noexcept { return size_; }

 private:
  std::array<std::uint8_t, kMaxRtuFrame> bytes_{};
  std::size_t size_ = 0;  // counts on beyond the buffer
};

/// Appends the CRC to a frame of `length` bytes in `frame`; the new length.
[[nodiscard]] std::size_t seal_rtu_frame(std::span<std::uint8_t> frame,
                                         std::size_t length) noexcept;

}  // namespace grapnel
