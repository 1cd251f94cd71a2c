#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/field.h"
#include "base/geometry.h"
#include "base/rng.h"
#include "pipeline/limits.h"
#include "pipeline/preprocess/working_depth.h"

namespace grapnel {

/// A plane as the camera sees it: 1/z = a u + b v + c over the region's pixels, and the same in
/// metres, camera frame.
struct DepthPlane {
  double a = 0.0, b = 0.0, c = 0.0;  ///< 1/m per pixel, 1/m per pixel, 1/m
  Vec3d normal = Vec3d::Zero();      ///< unit, toward the camera
  double offset_m = 0.0;             ///< n·p + offset = 0; the camera's distance from the plane
  double share = 0.0;                ///< of all readings that lie on it
};

struct PlaneSearchParams {
  int trials = 256;
  double min_share = 0.20;       ///< of all readings that must lie on it
  double sigmas = 3.0;           ///< half thickness in depth noise
  double sigma_1m_m = 0.001425;  ///< axial noise at 1 m, growing with z²
};

[[nodiscard]] FieldTable plane_search_fields() noexcept;

/// The plane through most of the labelled pixels: random triples in inverse depth, where a plane is
/// affine and Kinect-like noise constant, then least squares over its inliers. Works on a grid of
/// at most kMaxSamples pixels; the number of trials is fixed.
class PlaneSearch {
 public:
  static constexpr std::size_t kMaxSamples = 4800;

  explicit PlaneSearch(const PlaneSearchParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena);
  /// Searches the labelled pixels, which are `labelled_share` of the readings that min_share refers
  /// to. False when no plane has that share and `min_extent_m` both ways.
  bool find(const WorkingDepth& work, double labelled_share, double min_extent_m, Rng& rng,
            DepthPlane& plane) noexcept;

 private:
  void sample(const WorkingDepth& work) noexcept;
  /// Samples on the plane; some number up to `beaten` when there are no more than that.
  [[nodiscard]] std::size_t support(const DepthPlane& plane, std::size_t beaten) const noexcept;
  bool refine(DepthPlane& plane) const noexcept;
  [[nodiscard]] double extent_m(const DepthPlane& plane, const Intrinsics& k) const noexcept;

  PlaneSearchParams params_;
  std::span<float> u_, v_, inverse_, tolerance_;  ///< of the samples; 1/m
  std::size_t size_ = 0;
};

/// The plane n·p + offset = 0 (camera frame, normal toward the camera) over the pixels of `k`.
[[nodiscard]] DepthPlane depth_plane(const Vec3d& normal, double offset_m,
                                     const Intrinsics& k) noexcept;

}  // namespace grapnel
