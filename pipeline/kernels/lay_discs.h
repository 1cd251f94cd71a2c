#pragma once

#include <cstddef>
#include <cstdint>

#include "pipeline/kernels/draw_discs.h"
#include "pipeline/kernels/moved.h"
#include "pipeline/kernels/pair_features.h"

namespace grapnel::kernels {

/// Which points a camera sees as discs, and how large.
struct DiscLaw {
  float fx = 0.0F, fy = 0.0F, cx = 0.0F, cy = 0.0F;
  float radius_m = 0.0F;
  float least_cosine_square = 0.0F;  ///< between ray and normal: flatter ones are left out
  float most_px = 0.0F;              ///< a disc's radius at the most
  /// Pixels that are drawn, upper bounds excluded.
  std::int32_t u0 = 0, v0 = 0, u1 = 0, v1 = 0;
};

/// Rectangle that holds some discs, upper bounds excluded.
struct DiscBounds {
  std::int32_t u0 = 0, v0 = 0, u1 = 0, v1 = 0;
};

/// Moves the points `first` … `first + count - 1` and makes a tangent disc of each that faces the
/// camera and meets the pixels, in the points' order; `discs` has room for all. Returns their
/// number and widens `bounds` by them.
std::size_t lay_discs(const OrientedPlanes& points, std::size_t first, std::size_t count,
                      const Motion& motion, const DiscLaw& law, Disc* discs,
                      DiscBounds& bounds) noexcept;

namespace reference {
std::size_t lay_discs(const OrientedPlanes& points, std::size_t first, std::size_t count,
                      const Motion& motion, const DiscLaw& law, Disc* discs,
                      DiscBounds& bounds) noexcept;
}  // namespace reference

}  // namespace grapnel::kernels
