#include "pipeline/coarse/sight_image.h"

#include "base/assert.h"

namespace grapnel {

void SightImage::reserve(Arena& arena, std::size_t max_pixels) {
  z_ = arena.take<float>(max_pixels);
}

void SightImage::build(const DepthView& view) noexcept {
  const auto width = static_cast<std::size_t>(view.depth.width);
  const auto height = static_cast<std::size_t>(view.depth.height);
  GRAPNEL_ASSERT(width * height <= z_.size());
  for (std::size_t v = 0; v < height; ++v) {
    const std::uint16_t* const depth = view.depth.row(static_cast<int>(v));
    float* const z = z_.data() + v * width;
    for (std::size_t u = 0; u < width; ++u) {
      z[u] = view.metres_per_unit * static_cast<float>(depth[u]);
    }
    if (view.label.empty()) continue;
    const std::uint8_t* const label = view.label.row(static_cast<int>(v));
    for (std::size_t u = 0; u < width; ++u) z[u] = label[u] == 0 ? -z[u] : z[u];
  }
  pixels_.z = z_.data();
  pixels_.width = view.depth.width;
  pixels_.height = view.depth.height;
  pixels_.fx = static_cast<float>(view.intrinsics.fx);
  pixels_.fy = static_cast<float>(view.intrinsics.fy);
  pixels_.cx = static_cast<float>(view.intrinsics.cx) + 0.5F;
  pixels_.cy = static_cast<float>(view.intrinsics.cy) + 0.5F;
}

}  // namespace grapnel
