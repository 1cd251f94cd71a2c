#pragma once

#include <cstddef>
#include <cstdint>

#include "pipeline/kernels/moved.h"

namespace grapnel::kernels {

/// What a predicted pixel meets in the measurement.
enum class Met : std::int32_t {
  Nothing,  ///< nothing is predicted
  AtStep,   ///< the prediction ends or has a step within the rim
  NoReading,
  Behind,  ///< measured behind the surface
  Before,  ///< measured before it
  Ground,  ///< of the background, and at the surface's depth
  Within,  ///< within the limit of the surface's tangent plane
};

struct CompareLaw {
  float sigmas = 3.0F;  ///< limit: this many sigma, or the floor where that is more
  float sigma_per_m2 = 0.0F;
  float sigma_floor_m = 0.0F;
  float floor_m = 0.0F;
  int rim_px = 1;
  float least_cosine = 0.17F;  ///< of the angle between normal and ray
  float first_x = 0.0F;        ///< ray of the row's first pixel: (first_x, y, 1)…
  float step_x = 0.0F;         ///< …and what x grows by from pixel to pixel
  float y = 0.0F;
};

inline constexpr std::size_t kComparePad = 8;

/// A stretch of a row. All planes hold kComparePad elements more than `count`.
struct PredictedRow {
  const float* z = nullptr;   ///< metres, 0 = nothing; rim_px beside and rows away are readable
  std::ptrdiff_t width = 0;   ///< elements from a row to the next
  const float* nx = nullptr;  ///< normals in the model's frame
  const float* ny = nullptr;
  const float* nz = nullptr;
};
struct ComparedRow {
  std::int32_t* met = nullptr;    ///< Met
  float* off_m = nullptr;         ///< from the tangent plane, positive behind
  float* footprint_m2 = nullptr;  ///< of a pixel on the surface, times fx · fy
  float* nx = nullptr;            ///< normals in the camera's frame
  float* ny = nullptr;
  float* nz = nullptr;
};

/// Compares `count` predicted pixels with the measured ones: metres, 0 = none, negative where the
/// reading is of the background.
void compare_row(const PredictedRow& predicted, const float* measured, std::size_t count,
                 const Motion& motion, const CompareLaw& law, const ComparedRow& out) noexcept;

namespace reference {
void compare_row(const PredictedRow& predicted, const float* measured, std::size_t count,
                 const Motion& motion, const CompareLaw& law, const ComparedRow& out) noexcept;
}  // namespace reference

}  // namespace grapnel::kernels
