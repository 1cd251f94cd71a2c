#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/fixed_list.h"
#include "pipeline/judge/depth_view.h"
#include "pipeline/kernels/lay_discs.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Radius of a rendered point: it just closes the gaps between neighbours on a square lattice.
[[nodiscard]] inline float disc_radius_m(const Surface& model) noexcept {
  return 0.71F * static_cast<float>(model.spacing_m);
}

/// A point of the predicted outline.
struct ContourPoint {
  float u = 0.0F;  ///< projection of the model's point, px
  float v = 0.0F;
  float out_u = 0.0F;  ///< unit, out of the silhouette
  float out_v = 0.0F;
  std::int32_t point = 0;  ///< of the model
};

/// The depth image a camera would have of a model at a pose: points as small tangent discs into a
/// z-buffer, which hides what the model itself hides.
class ModelRender {
 public:
  void reserve(Arena& arena, std::size_t max_pixels, std::size_t max_contour);

  /// Renders into the view's box; contour() is then empty. Only points whose normal faces the
  /// camera leave a mark. O(points × disc).
  void render(const Surface& model, const Pose& camera_from_model, const DepthView& view) noexcept;

  /// Fills contour(): pixels beside which the model ends or falls away behind.
  void find_contour(const Surface& model, const Pose& camera_from_model,
                    const DepthView& view) noexcept;

  /// Depth of the nearest predicted pixel, 0 = nothing is predicted.
  [[nodiscard]] float nearest_m() const noexcept { return nearest_m_; }
  [[nodiscard]] const PixelBox& box() const noexcept { return box_; }
  /// A row's depths and points from column u on; kernels::kDiscPad more are readable behind.
  [[nodiscard]] const float* depths(int u, int v) const noexcept { return &z_[index(u, v)]; }
  [[nodiscard]] const std::int32_t* points(int u, int v) const noexcept {
    return &point_[index(u, v)];
  }
  /// Predicted depth, 0 = nothing. Precondition: the pixel lies in the box.
  [[nodiscard]] float z_m(int u, int v) const noexcept { return z_[index(u, v)]; }
  /// The model's point at a pixel; only where z_m() > 0.
  [[nodiscard]] std::int32_t point(int u, int v) const noexcept { return point_[index(u, v)]; }
  /// The prediction ends or has a step of more than `limit_m` within `reach` pixels. Precondition:
  /// there is one at the pixel.
  [[nodiscard]] bool at_step(int u, int v, int reach, float limit_m) const noexcept;
  [[nodiscard]] std::span<const ContourPoint> contour() const noexcept { return contour_.span(); }
  /// Pixels that hold a mark; empty (no width) when the model is out of view.
  [[nodiscard]] const PixelBox& marked() const noexcept { return marked_; }
  [[nodiscard]] std::size_t index(int u, int v) const noexcept {
    return static_cast<std::size_t>(v - box_.v0) * static_cast<std::size_t>(box_.width()) +
           static_cast<std::size_t>(u - box_.u0);
  }

 private:
  /// As kernels::outward_of(), for a pixel at the box's rim: outside of it nothing is there.
  void look_around(int u, int v, float behind_m, float& out_u, float& out_v) const noexcept;
  /// Discs leave 1/z, where a plane is affine; turns it into z.
  void finish() noexcept;

  PixelBox box_;
  PixelBox marked_;
  float nearest_m_ = 0.0F;
  Intrinsics intrinsics_;
  std::span<float> z_;
  std::span<std::int32_t> point_;
  FixedList<ContourPoint> contour_;
  std::span<kernels::Disc> discs_;
};

}  // namespace grapnel
