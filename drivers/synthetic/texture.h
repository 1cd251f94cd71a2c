#pragma once

#include <cstdint>

#include "base/geometry.h"
#include "base/image.h"
#include "drivers/synthetic/shapes.h"

namespace grapnel {

/// Colour of a part's surface: a pattern in the model frame, so that it moves with the part, lit
/// from beside the camera (Lambert).
class Texture {
 public:
  Texture() = default;
  /// `variant` changes the pattern's details.
  Texture(PartKind kind, double albedo, std::uint64_t variant);
  [[nodiscard]] Rgb8 color_at(const Vec3d& point_model_m, const Vec3f& normal_camera) const;

 private:
  PartKind kind_ = PartKind::Box;
  std::uint64_t variant_ = 0;
  Vec3f base_ = Vec3f::Zero();  // red, green, blue, 0…255, under full light
};

/// Light on a surface, 0…1.
[[nodiscard]] float light_on(const Vec3f& normal_camera);

/// Colour of the belt under that much light: dark rubber with a coarse weave.
[[nodiscard]] Rgb8 belt_color(double along_m, double across_m, float light);

}  // namespace grapnel
