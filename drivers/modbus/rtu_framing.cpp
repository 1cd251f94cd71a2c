#include "drivers/modbus/rtu_framing.h"

#include <algorithm>

namespace grapnel {
namespace {

constexpr std::size_t kShortestFrame = 4;  // slave id, function, CRC
constexpr std::int64_t kFastLineSilenceUs = 1750;
constexpr int kFastBaud = 19200;

}  // namespace

std::uint16_t crc16_modbus(std::span<const std::uint8_t> bytes) noexcept {
  std::uint16_t crc = 0xffff;
  for (const std::uint8_t byte : bytes) {
    crc = static_cast<std::uint16_t>(crc ^ byte);
    for (int bit = 0; bit < 8; ++bit) {
      const bool carry = (crc & 1) != 0;
      crc = static_cast<std::uint16_t>(crc >> 1);
      if (carry) crc = static_cast<std::uint16_t>(crc ^ 0xa001);
    }
  }
  return crc;
}

std::int64_t rtu_silence_us(int baud) noexcept {
  if (baud > kFastBaud) return kFastLineSilenceUs;
  return std::int64_t{38'500'000} / baud;  // 3.5 × 11 bits
}

void RtuAssembler::received(std::span<const std::uint8_t> bytes) noexcept {
  const std::size_t room = size_ < bytes_.size() ? bytes_.size() - size_ : 0;
  std::copy_n(bytes.begin(), std::min(room, bytes.size()),
              bytes_.begin() + static_cast<std::ptrdiff_t>(std::min(size_, bytes_.size())));
  size_ += bytes.size();
}

std::span<const std::uint8_t> RtuAssembler::end_frame() noexcept {
  const std::size_t size = size_;
  size_ = 0;
  if (size < kShortestFrame || size > bytes_.size()) return {};
  const std::span<const std::uint8_t> body(bytes_.data(), size - 2);
  const std::uint16_t crc = crc16_modbus(body);
  const bool intact = bytes_[size - 2] == (crc & 0xff) && bytes_[size - 1] == crc >> 8;
  return intact ? body : std::span<const std::uint8_t>{};
}

std::size_t seal_rtu_frame(std::span<std::uint8_t> frame, std::size_t length) noexcept {
  const std::uint16_t crc = crc16_modbus(frame.first(length));
  frame[length] = static_cast<std::uint8_t>(crc & 0xff);
  frame[length + 1] = static_cast<std::uint8_t>(crc >> 8);
  return length + 2;
}

}  // namespace grapnel
