#include "base/hash.h"

#include <cstring>

#include "base/rng.h"

namespace grapnel {

std::uint64_t hash_bytes(std::span<const std::byte> bytes, std::uint64_t seed) noexcept {
  std::uint64_t state = Rng::mix(seed ^ bytes.size());
  std::size_t at = 0;
  for (; at + 8 <= bytes.size(); at += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + at, 8);
    state = Rng::mix(state ^ word) + 0x9e3779b97f4a7c15ULL;
  }
  std::uint64_t tail = 0;
  if (at < bytes.size()) std::memcpy(&tail, bytes.data() + at, bytes.size() - at);
  return Rng::mix(state ^ tail);
}

std::uint16_t fingerprint16(std::span<const std::byte> bytes) noexcept {
  const std::uint64_t hash = hash_bytes(bytes);
  const auto folded = static_cast<std::uint16_t>(hash ^ (hash >> 16) ^ (hash >> 32) ^ (hash >> 48));
  return folded == 0 ? std::uint16_t{1} : folded;
}

}  // namespace grapnel
