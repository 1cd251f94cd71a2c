#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace grapnel::kernels {

/// For every set of eight lanes the lanes in it, in order, then zeros. The library's own table is a
/// local array, which the compiler copies to the stack at each use: thirty cycles.
inline constexpr auto kLanesOf = [] {
  std::array<std::array<std::int32_t, 8>, 256> table{};
  for (std::size_t bits = 0; bits < table.size(); ++bits) {
    std::size_t count = 0;
    for (std::int32_t lane = 0; lane < 8; ++lane) {
      if ((bits >> lane & 1U) != 0) table[bits][count++] = lane;
    }
  }
  return table;
}();

}  // namespace grapnel::kernels
