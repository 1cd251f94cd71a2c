#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "pipeline/judge/depth_view.h"
#include "pipeline/judge/model_render.h"

namespace grapnel {

/// What the measurement says about one pose against another.
struct Contrast {
  double gain = 0.0;   ///< squared deviations in sigma (9 at most each) that the first pose saves,
                       ///< per independent reading
  double share = 0.0;  ///< gain over the sum of its magnitudes: 1 = every reading speaks for the
                       ///< first pose, -1 = for the second

  /// How surely the first pose is told from the second, 0…1: most readings must agree, and there
  /// must be more of them than two or three that only one pose explains, up to a dozen.
  [[nodiscard]] double certainty() const noexcept;
  /// Too few readings tell the poses apart to say which is right.
  [[nodiscard]] bool alike() const noexcept;
  /// Nine of ten of so many readings speak for the first pose that certainty() is at least 0.8.
  [[nodiscard]] bool beyond_doubt() const noexcept;
};

/// Compares two poses of a model where, and only where, their predicted depth images differ: on a
/// nearly symmetric part that is the small surface that tells its poses apart, of which shares of
/// the whole surface say nothing.
class RivalTest {
 public:
  void reserve(Arena& arena, std::size_t max_pixels, std::size_t max_width);

  /// Takes the first pose's image over.
  void keep(const ModelRender& first) noexcept;
  /// The first pose against one rendered into the same box; `shared_px` pixels of the view share
  /// one error. O(pixels of both).
  [[nodiscard]] Contrast against(const ModelRender& second, const DepthView& view,
                                 double shared_px) noexcept;

 private:
  /// Fills sides_ of a box that holds both images: 1 where the first pose's surface is the nearer
  /// one, or the only one; -1 where the second's is; 0 where they are alike.
  void take_sides(const ModelRender& second, const DepthView& view, const PixelBox& box) noexcept;

  std::span<float> z_m_;
  std::span<float> row_first_, row_second_;  // a row of either image, 0 outside of what is marked
  std::span<std::int8_t> sides_;
  PixelBox marked_;
};

}  // namespace grapnel
