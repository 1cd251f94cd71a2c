#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/geometry.h"

namespace grapnel {

/// A board's corners as one image shows them.
struct BoardView {
  std::vector<Eigen::Vector2d> corners_px;
};

/// What a board's images say of their camera.
struct CameraFit {
  Intrinsics intrinsics;
  std::vector<double> distortion;   ///< k1 k2 p1 p2 of Brown's model
  double rms_px = 0.0;              ///< of the corners
  std::vector<double> view_rms_px;  ///< image by image
  /// One standard deviation of fx fy cx cy, from the residuals and the images' geometry.
  std::vector<double> sigma_px;
};

/// Fits a pinhole camera with lens distortion to a flat board of columns × rows corners, `square_m`
/// apart (Zhang 2000): homographies, the closed form, then least squares over camera and poses.
/// Throws InputError: under three images, or all from nearly one direction.
[[nodiscard]] CameraFit fit_camera(const std::vector<BoardView>& views, int columns, int rows,
                                   double square_m, int width, int height);

}  // namespace grapnel
