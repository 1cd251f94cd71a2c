#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "drivers/modbus/modbus_config.h"
#include "drivers/modbus/registers.h"

namespace grapnel {

/// Every register that a client can read, by 0-based address, in host byte order. Holding registers
/// 100…911 mirror the input registers, so one array serves both. Owned by the field bus thread.
class RegisterImage {
 public:
  static constexpr std::size_t kSize = registers::kLastReadOnly + 1;

  explicit RegisterImage(WordOrder order = WordOrder::Abcd) noexcept
      : high_first_(order == WordOrder::Abcd) {}

  [[nodiscard]] std::uint16_t u16(std::size_t address) const noexcept { return words_[address]; }
  [[nodiscard]] std::uint32_t u32(std::size_t address) const noexcept {
    const std::uint32_t first = words_[address];
    const std::uint32_t second = words_[address + 1];
    return high_first_ ? first << 16 | second : second << 16 | first;
  }
  [[nodiscard]] std::int32_t i32(std::size_t address) const noexcept {
    return static_cast<std::int32_t>(u32(address));
  }

  void set_u16(std::size_t address, std::uint16_t value) noexcept { words_[address] = value; }
  void set_u32(std::size_t address, std::uint32_t value) noexcept {
    const auto high = static_cast<std::uint16_t>(value >> 16);
    const auto low = static_cast<std::uint16_t>(value & 0xffff);
    words_[address] = high_first_ ? high : low;
    words_[address + 1] = high_first_ ? low : high;
  }
  void set_i32(std::size_t address, std::int32_t value) noexcept {
    set_u32(address, static_cast<std::uint32_t>(value));
  }
  void set_f32(std::size_t address, float value) noexcept {
    set_u32(address, std::bit_cast<std::uint32_t>(value));
  }

  /// kSize registers.
  [[nodiscard]] std::uint16_t* data() noexcept { return words_.data(); }

 private:
  std::array<std::uint16_t, kSize> words_{};
  bool high_first_;
};

}  // namespace grapnel
