#pragma once

#include <cstdint>

#include "base/math.h"

namespace grapnel {

/// Counter-based random numbers: the n-th number is a pure function of (seed, n), so a stream
/// replays alone and splits without a lock. Mixing after Steele, Lea and Flood 2014 (SplitMix64).
class Rng {
 public:
  explicit Rng(std::uint64_t seed) noexcept : seed_(mix(seed + kGolden)) {}

  [[nodiscard]] std::uint64_t next_u64() noexcept { return mix(seed_ + kGolden * ++counter_); }
  [[nodiscard]] std::uint32_t next_u32() noexcept {
    return static_cast<std::uint32_t>(next_u64() >> 32);
  }
  /// Uniform in 0…bound-1; bound > 0. Multiply-shift, bias below 2^-32.
  [[nodiscard]] std::uint32_t below(std::uint32_t bound) noexcept {
    return static_cast<std::uint32_t>((static_cast<std::uint64_t>(next_u32()) * bound) >> 32);
  }
  /// Uniform in [0, 1).
  [[nodiscard]] double uniform() noexcept {
    return static_cast<double>(next_u64() >> 11) * 0x1.0p-53;
  }
  [[nodiscard]] double uniform(double low, double high) noexcept {
    return low + (high - low) * uniform();
  }
  /// Standard normal, Box and Muller 1958 without libm.
  [[nodiscard]] double normal() noexcept;

  /// An independent stream named by `label`.
  [[nodiscard]] Rng split(std::uint64_t label) const noexcept {
    return Rng(mix(seed_ ^ mix(label)));
  }

  [[nodiscard]] static constexpr std::uint64_t mix(std::uint64_t z) noexcept {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }

 private:
  static constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15ULL;
  std::uint64_t seed_;
  std::uint64_t counter_ = 0;
};

}  // namespace grapnel
