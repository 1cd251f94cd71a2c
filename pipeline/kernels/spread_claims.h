#pragma once

#include <cstddef>
#include <cstdint>

namespace grapnel::kernels {

/// What a voxel knows of its nearest seed: the distance squared in sixteenths of a voxel squared in
/// the upper half, the seed's name in the lower. The lesser of two claims is of the nearer seed,
/// the lower name's where both are as near.
using Claim = std::uint32_t;
inline constexpr Claim kClaimUnit = Claim{16} << 16;  ///< of one voxel squared
/// No seed within reach, name 0.
inline constexpr Claim kUnclaimed = 0x7fff0000U;

inline constexpr int kMaxClaimSide = 512;
/// Three times its square, in sixteenths, stays below what kUnclaimed holds.
inline constexpr int kMaxClaimReach = 26;

/// Elements behind the last voxel that spread_claims() may read, on targets that can't load a part
/// of a vector.
inline constexpr std::size_t kClaimSlack = 8;

/// One pass of an exact distance transform: each voxel of a box gets the least of the claims up to
/// `reach` (at most kMaxClaimReach) voxels away along an axis, each farther by the distance
/// squared. Voxel (x, y, z) has index (z * size[1] + y) * size[0] + x; sides of at most
/// kMaxClaimSide, kClaimSlack elements behind the last. O(voxels × reach).
void spread_claims(int axis, const std::int32_t (&size)[3], int reach, Claim* claims) noexcept;

}  // namespace grapnel::kernels
