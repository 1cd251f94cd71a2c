#pragma once

#include <cstddef>
#include <cstdint>

#include "pipeline/kernels/moved.h"
#include "pipeline/kernels/pair_features.h"

namespace grapnel::kernels {

// Ratings of a pose by samples of a surface. All sample planes hold in_lanes(count) elements.

/// Where samples are looked up: a depth image without gaps between its rows.
struct SignedDepth {
  const float* z = nullptr;  ///< metres, 0 = no reading, negative: of the background
  std::int32_t width = 0;
  std::int32_t height = 0;
  float fx = 0.0F, fy = 0.0F;
  float cx = 0.0F, cy = 0.0F;  ///< of the principal point plus a half, so that pixels are floors
};

/// Worth of a sample by what is measured where it should be seen, times its cosine to the ray.
struct SightLaw {
  float tolerance_m = 0.0F;
  float cos_facing = 0.0F;  ///< samples seen flatter than this don't count
  float no_reading = 0.0F;  ///< taken off where nothing is measured
  float hidden = 0.0F;      ///< where something is in front
  float seen_through = 0.0F;
};
struct Sight {
  float facing = 0.0F;  ///< Σ cosine of the samples that face the camera
  float worth = 0.0F;   ///< Σ cosine × (1 - (off / tolerance)²) of those met, less the penalties
};
[[nodiscard]] Sight rate_sight(const OrientedPlanes& samples, std::size_t count,
                               const Motion& motion, const SignedDepth& pixels,
                               const SightLaw& law) noexcept;

/// Σ 1 - (distance / tolerance)² of the samples whose voxel names a point that is nearer than the
/// tolerance and whose normals agree to `cos_normal` (a sample without one always agrees).
struct NamedSurface {
  VoxelShape voxels;
  const std::uint16_t* named = nullptr;
  OrientedPlanes points;
};
[[nodiscard]] float rate_on_surface(const OrientedPlanes& samples, std::size_t count,
                                    const Motion& motion, const NamedSurface& surface,
                                    float tolerance_m, float cos_normal) noexcept;

/// Σ worth[level of the sample's voxel]; 0 outside of the box.
struct LevelField {
  VoxelShape voxels;
  const std::uint8_t* level = nullptr;
  const float* worth = nullptr;
};
[[nodiscard]] float rate_in_field(const OrientedPlanes& samples, std::size_t count,
                                  const Motion& motion, const LevelField& field) noexcept;

}  // namespace grapnel::kernels
