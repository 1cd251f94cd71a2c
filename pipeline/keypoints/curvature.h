#pragma once

#include <span>

#include "base/field.h"
#include "pipeline/keypoints/maxima.h"
#include "pipeline/preprocess/principal_curvature.h"
#include "pipeline/stage.h"

namespace grapnel {

struct CurvatureKeypointParams {
  CurvatureParams curvature;
  double non_max_radius_m = 0.0;  ///< one keypoint within; 0 = the curvature's radius
  double min_curvature = 0.01;    ///< least larger curvature of a keypoint
  double min_ratio = 0.0;         ///< of the smaller curvature to the larger: 0 a ridge, 1 a cap
  double max_ratio = 1.0;
};

[[nodiscard]] FieldTable curvature_keypoint_fields() noexcept;

/// Points whose larger principal curvature is the largest around and whose shape, ridge to cap,
/// lies in a band. PCL has the curvatures but no detector of them. Score = the larger curvature.
class CurvatureDetector final : public KeypointDetector {
 public:
  explicit CurvatureDetector(const CurvatureKeypointParams& params) noexcept
      : params_(params), curvature_(params.curvature) {}

  void reserve(Arena& arena, const Limits& limits) override;
  Status detect(const Surface& surface, KeypointSet& keypoints) noexcept override;

 private:
  CurvatureKeypointParams params_;
  PrincipalCurvature curvature_;
  LocalMaxima maxima_;
};

}  // namespace grapnel
