#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "base/cloud.h"
#include "base/geometry.h"

namespace grapnel {

/// The six sides a model is looked at from: the direction from its middle toward the viewer.
struct ModelSide {
  std::string_view name;
  Vec3d toward_viewer;
};
[[nodiscard]] std::span<const ModelSide> model_sides() noexcept;

/// How much of an object a model holds.
struct ModelQuality {
  double view_sphere_coverage = 0.0;  ///< share of directions within 30 degrees of a camera's
  double open_share = 0.0;  ///< share of the outline, from all around, that shows a back side
  std::array<double, 6> side_open_share{};  ///< the same of each side: what was never seen from it
};

/// `cloud` has normals; `voxel_m` is the distance of its points; `cameras` are where it was seen
/// from, in the model's frame. O(points).
[[nodiscard]] ModelQuality measure_quality(const CloudData& cloud, double voxel_m,
                                           const std::vector<Vec3d>& cameras);

/// A model seen from far away.
struct ModelPicture {
  int width = 0;
  int height = 0;
  std::vector<Rgb8> pixels;
  double open_share = 0.0;  ///< of the outline's pixels; 0 for none
};

/// Draws every point as a disc, the nearest wins: surfaces in grey by their slant, their back sides
/// in red. Everything within `radius_m` of `centre` fits into `size_px` squared.
[[nodiscard]] ModelPicture draw_model(const CloudData& cloud, double voxel_m, const Vec3d& centre,
                                      double radius_m, const Vec3d& toward_viewer, int size_px);

/// The six sides in two rows, in the order of model_sides().
[[nodiscard]] ModelPicture draw_sides(const CloudData& cloud, double voxel_m, int size_px);

}  // namespace grapnel
