#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "drivers/replay/camera_file.h"

namespace grapnel {

/// A flat wall or an empty belt as a sensor saw it: means over a recording's frames.
struct WallView {
  std::string name;
  int width = 0;
  int height = 0;
  std::vector<double> z_m;           ///< 0: no reading in most frames
  std::optional<double> distance_m;  ///< measured, along the optical axis
};

/// Means of the first `frames` frames of a recording without depth correction. `name` may end in
/// =METRES, the measured distance. Throws InputError.
[[nodiscard]] WallView read_wall(const std::string& name, std::size_t frames, CameraFile& camera);

/// How one wall comes out.
struct WallReport {
  std::string name;
  double axis_m = 0.0;  ///< where its plane met the optical axis, as measured by the sensor
  double corrected_axis_m = 0.0;
  double plane_share = 0.0;   ///< of the readings
  double rms_before_m = 0.0;  ///< off its own best plane
  double rms_after_m = 0.0;
};

struct GridShape {
  int columns = 16;
  int rows = 12;
};

/// Fits the disparity law to the walls whose distance is given (a scale from one, scale and offset
/// from two or more), then a grid of multipliers that makes every wall flat, and writes both into
/// `camera`. A wall's tilt comes from the wall itself, since nobody measures it. Throws InputError
/// when a wall is not one: under 60 % of its readings on a plane.
[[nodiscard]] std::vector<WallReport> calibrate_depth(const std::vector<WallView>& walls,
                                                      const GridShape& grid, CameraFile& camera);

}  // namespace grapnel
