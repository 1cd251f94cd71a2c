#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace grapnel {

/// LZF (liblzf's format 1), as PCD's binary_compressed uses it. A control byte below 32 starts
/// control + 1 literal bytes; any other a copy from at most 8192 bytes back.

/// No step of the format makes more than this many bytes of one: 264 of a 3-byte copy.
inline constexpr std::size_t kMaxLzfRatio = 88;

/// Fills `out` exactly. False when `in` is not LZF or does not make exactly out.size() bytes.
[[nodiscard]] bool lzf_decompress(std::span<const std::byte> in, std::span<std::byte> out) noexcept;

/// Always succeeds; incompressible input grows by 1/32. O(n).
[[nodiscard]] std::vector<std::byte> lzf_compress(std::span<const std::byte> in);

}  // namespace grapnel
