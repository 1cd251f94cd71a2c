#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/fixed_list.h"
#include "base/geometry.h"

namespace grapnel {

/// An interest point: index into its surface, the detector's response and the scale it belongs to.
struct Keypoint {
  std::int32_t point = 0;
  float score = 0.0F;
  float scale_m = 0.0F;
  /// From the surface's point to the keypoint's own place: not zero where a detector places
  /// keypoints between the samples.
  Vec3f offset_m = Vec3f::Zero();
};
/// Keeps the strongest when the detector finds more than fit; `overflowed()` then says so.
using KeypointSet = FixedList<Keypoint>;

/// One descriptor a row, padded with zeros to a multiple of 16 floats.
struct FeatureMatrix {
  std::span<float> values;  ///< capacity rows × stride
  std::size_t rows = 0;
  std::size_t dimension = 0;
  std::size_t stride = 0;

  static constexpr std::size_t padded(std::size_t dimension_) noexcept {
    return (dimension_ + 15) / 16 * 16;
  }
  [[nodiscard]] std::span<float> row(std::size_t i) const noexcept {
    return values.subspan(i * stride, dimension);
  }
  void reserve(Arena& arena, std::size_t max_rows, std::size_t dimension_);
};

/// A pair of keypoints whose descriptors are near: indices into the two KeypointSets.
struct Correspondence {
  std::int32_t source = 0;
  std::int32_t target = 0;
  float distance = 0.0F;  ///< in the metric's own unit
};
using Correspondences = FixedList<Correspondence>;

/// A candidate pose with what supports it (count of inliers or a verification score; larger is
/// better).
struct Hypothesis {
  Pose target_from_source = Pose::Identity();
  double support = 0.0;
};
using Hypotheses = FixedList<Hypothesis>;

/// What fine registration found.
struct RefinedPose {
  Pose target_from_source = Pose::Identity();
  Mat6d information =
      Mat6d::Zero();    ///< of (translation, rotation) at the target frame's origin, 1/m², 1/rad²
  double rmse_m = 0.0;  ///< of the residuals of the last iteration's partners
  std::uint32_t partners = 0;
  std::uint32_t iterations = 0;
  bool converged = false;
};

}  // namespace grapnel
