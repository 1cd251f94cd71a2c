#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/geometry.h"

namespace grapnel {

/// Points with or without normals somewhere before a camera.
struct PlacedPoints {
  std::span<const float> x, y, z;
  std::span<const float> nx, ny, nz;  ///< outward; empty = none, every point is drawn
  double spacing_m = 0.0;
  Pose camera_from_points = Pose::Identity();
};

/// The depth image a camera would have of points, each a small disc or, without normal, a square.
class PointRender {
 public:
  explicit PointRender(const Intrinsics& camera);

  /// Adds points to what is there; the nearest one is seen. O(points × disc).
  void add(const PlacedPoints& points);

  /// Depth in metres, 0 = nothing.
  [[nodiscard]] float z_m(int u, int v) const noexcept { return z_[index(u, v)]; }
  /// Cosine between ray and normal, 1 without normals.
  [[nodiscard]] float cosine(int u, int v) const noexcept { return cosine_[index(u, v)]; }
  /// Some neighbour is empty, or lies behind by more than a twentieth of the depth.
  [[nodiscard]] bool on_outline(int u, int v) const noexcept;
  [[nodiscard]] const Intrinsics& camera() const noexcept { return camera_; }
  /// True when nothing was drawn inside of the image.
  [[nodiscard]] bool empty() const noexcept;

 private:
  struct Disc;
  void draw(const Disc& disc);
  [[nodiscard]] std::size_t index(int u, int v) const noexcept {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(camera_.width) +
           static_cast<std::size_t>(u);
  }

  Intrinsics camera_;
  std::vector<float> z_;
  std::vector<float> cosine_;
};

}  // namespace grapnel
