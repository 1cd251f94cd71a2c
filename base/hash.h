#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace grapnel {

/// 64-bit hash of bytes, the same on every machine; for seeds and fingerprints, not for security.
/// Eight bytes a step, mixed as in Rng. O(n).
[[nodiscard]] std::uint64_t hash_bytes(std::span<const std::byte> bytes,
                                       std::uint64_t seed = 0) noexcept;

/// 16-bit fold of hash_bytes, never 0.
[[nodiscard]] std::uint16_t fingerprint16(std::span<const std::byte> bytes) noexcept;

}  // namespace grapnel
