#pragma once

#include <cstdint>
#include <string>

#include "base/config.h"
#include "base/field.h"

namespace grapnel {

/// What the depth image holds.
enum class FreenectDepth : std::uint8_t {
  Millimetres,  ///< the library's whole millimetres, in the infrared camera's image
  Raw,          ///< the sensor's 11 bits by the device's own constants, in 0.2 mm
  Registered,   ///< whole millimetres, moved into the colour camera's image
};

/// The keys of [camera] when driver = "freenect".
struct FreenectOptions {
  std::string serial;  ///< the unit to open; "": any
  FreenectDepth depth = FreenectDepth::Millimetres;
  bool color = true;
  double fx = 0.0;  ///< with fy, cx, cy: instead of the device's own; 0: the device's own
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;

  [[nodiscard]] static FieldTable fields() noexcept;
};

/// Reads the table; `driver` is skipped. Throws InputError.
[[nodiscard]] FreenectOptions read_freenect_options(const ConfigTable& camera);

}  // namespace grapnel
