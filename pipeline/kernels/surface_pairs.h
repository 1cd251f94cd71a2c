#pragma once

#include <cstddef>
#include <cstdint>

#include "pipeline/kernels/moved.h"
#include "pipeline/kernels/pair_features.h"

namespace grapnel::kernels {

inline constexpr std::size_t kBlockPoints = 128;

/// A few points with normals and their partners on another surface. The arrays are valid up to the
/// next multiple of kLanes; there partner is -1.
struct PointBlock {
  alignas(64) float x[kBlockPoints], y[kBlockPoints], z[kBlockPoints];
  alignas(64) float nx[kBlockPoints], ny[kBlockPoints], nz[kBlockPoints];
  alignas(64) std::int32_t partner[kBlockPoints];  ///< -1 = none
  std::size_t size = 0;
};

/// Moves points and turns normals.
void move_block(const Motion& motion, PointBlock& block) noexcept;

/// Voxel of each of `count` points, -1 outside; all arrays hold in_lanes(count) elements.
void find_voxels(const VoxelShape& shape, const float* x, const float* y, const float* z,
                 std::size_t count, std::int32_t* voxel) noexcept;

/// Points named by voxels.
struct NamedPoints {
  VoxelShape voxels;
  const std::uint16_t* named = nullptr;
  const float* x = nullptr;
  const float* y = nullptr;
  const float* z = nullptr;
};
/// Of the points that the eight voxels around each place name, the nearest one within the distance,
/// the last of equally near ones in the order z, y, x; -1 = none. All arrays hold in_lanes(count)
/// elements.
void find_nearest_named(const NamedPoints& points, const float* x, const float* y, const float* z,
                        std::size_t count, float max_distance_m, std::int32_t* found) noexcept;

/// Which pairs count, and how much.
struct PairGate {
  float max_square_m2 = 0.0F;     ///< distance of partners, squared
  float kernel_square_m2 = 0.0F;  ///< Geman and McClure's scale, squared
  float cos_normal = -1.0F;       ///< least cosine between normals, where both are
  float centre[3] = {};           ///< levers are taken about it
  bool symmetric = false;         ///< error along the sum of both normals (Rusinkiewicz 2019)
};

/// Partial sums of the constraint "x moves by -residual along the direction": the upper triangle of
/// Σ w J Jᵀ row by row (21), Σ w J residual (6), Σ w lever², Σ w, Σ residual², pairs.
inline constexpr int kPlaneSums = 31;
struct PlaneSums {
  alignas(64) float sum[kPlaneSums][kLanes];
};
void add_plane_pairs(const PointBlock& block, const OrientedPlanes& fixed, const PairGate& gate,
                     PlaneSums& sums) noexcept;

/// Partial sums over pairs of points less the centre: Σ w, Σ w source, Σ w target,
/// Σ w source targetᵀ row by row, Σ distance², pairs.
inline constexpr int kPointSums = 18;
struct PointSums {
  alignas(64) float sum[kPointSums][kLanes];
};
void add_point_pairs(const PointBlock& block, const OrientedPlanes& fixed, const PairGate& gate,
                     PointSums& sums) noexcept;

}  // namespace grapnel::kernels
