#pragma once

#include "base/geometry.h"
#include "pipeline/judge/depth_view.h"
#include "pipeline/judge/model_render.h"
#include "pipeline/surface.h"

namespace grapnel {

/// How far readings may be trusted, beside the view's own noise along the view.
struct ReadingSpread {
  /// Sensor pixels that share one error: structured light looks at windows of 7 to 9 px, which make
  /// up two thirds of a reading's variance; the rest is quantisation. Checked by the error of poses
  /// on simulated frames.
  double shared_px = 33.0;
  double across_px = 0.7;   ///< 1-sigma of a reading across the view, sensor pixels
  double outline_px = 1.0;  ///< 1-sigma of an outline that meets a depth edge, sensor pixels
  double floor_m = 0.0;     ///< match tolerance at the least
};

/// Information about a pose, and what else is known of its error. The inverse information carries
/// each sum of weight × gradient × error to the shift of the pose that such errors make.
struct PoseReadings {
  Mat6d information = Mat6d::Zero();
  /// Of errors in common: all outlines one sensor pixel to the right, or down; all depths one sigma
  /// too large.
  Eigen::Matrix<double, 6, 3> common = Eigen::Matrix<double, 6, 3>::Zero();
  /// Of rounded depths: disparity has few values, and each of them, in whole units of depth, errs
  /// by up to half a unit, the same wherever it is read. A level face shows one such error, a
  /// tilted one many, in stripes across its slope. Covariance of the sum over all values.
  Mat6d rounding = Mat6d::Zero();
  /// Of what the readings deviate at the pose: where it is not the one that they fit best.
  Vec6d misfit = Vec6d::Zero();
};

/// What the measurement says about a pose, by the judge's own pixels: the Fisher information of
/// (translation, rotation) at the camera's origin, 1/m² and 1/rad², whose inverse is the least
/// covariance that any registration of these readings can have (Cramér and Rao). Every matched
/// pixel is a reading of the depth along its ray, every outline point that a depth edge meets one
/// of where the part ends across its outline. Shares nothing with refinement.
/// `render` holds the model at the pose, contour included. O(pixels of the model).
[[nodiscard]] PoseReadings pose_information(const Surface& model, const Pose& camera_from_model,
                                            const ModelRender& render, const DepthView& view,
                                            const EdgeMap& edges,
                                            const ReadingSpread& spread) noexcept;

}  // namespace grapnel
