#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace grapnel {

static_assert(std::endian::native == std::endian::little,
              "the file formats are read and written as the machine holds them");

/// A T from unaligned bytes.
template <class T>
[[nodiscard]] T load(const std::byte* at) noexcept {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

/// Appends the bytes of `value`.
template <class T>
void append(std::vector<std::byte>& out, const T& value) {
  const auto* const first = reinterpret_cast<const std::byte*>(&value);
  out.insert(out.end(), first, first + sizeof value);
}

}  // namespace grapnel
