#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/geometry.h"
#include "base/image.h"
#include "drivers/synthetic/mesh.h"

namespace grapnel {

/// Nearest surface per pixel: a z-buffer over 1/z, which is affine in the image for every plane, so
/// that each pixel holds the exact depth of the triangle that its centre's ray meets. Plain
/// arithmetic in a fixed order: the same bits everywhere.
class Rasterizer {
 public:
  /// Corners nearer than this are behind the lens; their triangles are left out.
  static constexpr double kNear_m = 0.05;
  static constexpr std::int32_t kNoFace = -1;

  /// What one draw covered.
  struct Outline {
    std::size_t pixels = 0;  ///< inside the image, hidden ones included
    bool inside = false;     ///< no part of it lies outside the image
  };

  explicit Rasterizer(const Intrinsics& intrinsics);

  /// Forgets every surface.
  void clear();
  /// Draws the sides of the mesh that face the camera. Its faces are numbered from `first_face`
  /// in the mesh's order. O(covered pixels + triangles).
  Outline draw(const Mesh& mesh, const Pose& camera_from_model, std::int32_t first_face);

  /// 1/m; 0 where there is nothing.
  [[nodiscard]] ImageView<const float> inverse_depth() const { return view(inverse_depth_); }
  /// Number of the face; kNoFace where there is nothing.
  [[nodiscard]] ImageView<const std::int32_t> face() const { return view(face_); }
  [[nodiscard]] const Intrinsics& intrinsics() const { return intrinsics_; }

 private:
  struct Corner {
    double u = 0.0;
    double v = 0.0;
    double inverse_z = 0.0;  ///< 0: behind the lens
  };
  struct Setup;

  template <class T>
  [[nodiscard]] ImageView<const T> view(const std::vector<T>& pixels) const {
    return {pixels.data(), intrinsics_.width, intrinsics_.height};
  }
  /// True when all of it lies inside the image.
  bool project(const Mesh& mesh, const Pose& camera_from_model);
  [[nodiscard]] bool set_up(const Mesh::Triangle& triangle, Setup& setup) const;
  std::size_t fill(const Setup& setup, std::int32_t face);

  Intrinsics intrinsics_;
  std::vector<float> inverse_depth_;
  std::vector<std::int32_t> face_;
  std::vector<std::uint32_t> covered_by_;  // number of the last draw that covered the pixel
  std::uint32_t draws_ = 0;
  std::vector<Vec3d> points_m_;
  std::vector<Corner> corners_;
};

}  // namespace grapnel
