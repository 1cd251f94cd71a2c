#pragma once

#include <cstddef>
#include <cstdint>

namespace grapnel::kernels {

/// Pairs of points, source to target; each plane has 8 readable elements behind the last pair.
struct PairPlanes {
  const float* sx = nullptr;
  const float* sy = nullptr;
  const float* sz = nullptr;
  const float* tx = nullptr;
  const float* ty = nullptr;
  const float* tz = nullptr;
};

/// target = r source + t.
struct RigidMotion {
  float r[9] = {1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F};  ///< row after row
  float t[3] = {};
};

/// Pairs whose source the motion carries within the distance of its target. May stop, with what it
/// has, once `to_beat` can't be exceeded any more.
std::size_t count_inliers(const PairPlanes& pairs, std::size_t count, const RigidMotion& motion,
                          float squared_m2, std::size_t to_beat) noexcept;

/// When two pairs may belong to one motion.
struct PairAgreement {
  float tolerance_m = 0.0F;   ///< of the lengths between their sources and between their targets
  float min_length_m = 0.0F;  ///< shorter says nothing
};

/// Bit j of `bits` (whole words of 64, zeros behind `count`) is set where pair j agrees with pair
/// i. Bit i is 0 when min_length_m > 0.
void agreeing_pairs(const PairPlanes& pairs, std::size_t count, std::size_t pair_i,
                    const PairAgreement& agreement, std::uint64_t* bits) noexcept;

}  // namespace grapnel::kernels
