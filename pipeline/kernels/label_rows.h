#pragma once

#include <cstddef>
#include <cstdint>

namespace grapnel::kernels {

/// A plane as a row of a depth image meets it: on the ray of pixel u it lies at depth
/// 1 / (start + a * u).
struct PlaneRow {
  float metres_per_unit = 0.0F;
  float start = 0.0F;
  float a = 0.0F;
  float offset_m = 0.0F;  ///< of the plane from the camera
};

/// Height above the plane at which a reading belongs to something on it, whichever is most.
struct HeightLaw {
  float noise = 0.0F;  ///< × offset × depth, per m
  float height_m = 0.0F;
  float ratio = 0.0F;  ///< × depth
};

/// Clears the labels of those of `count` readings that are not above the plane.
void keep_above_plane(const std::uint16_t* depth, std::size_t count, const PlaneRow& plane,
                      const HeightLaw& law, std::uint8_t* label) noexcept;

/// Copies `count` readings; those outside of least…most become 0 and get label 0, the others get
/// `label`. Returns how many those are.
std::size_t copy_in_range(const std::uint16_t* from, std::size_t count, std::uint16_t least,
                          std::uint16_t most, std::uint8_t label, std::uint16_t* depth,
                          std::uint8_t* labels) noexcept;

}  // namespace grapnel::kernels
