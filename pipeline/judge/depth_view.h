#pragma once

#include <cmath>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/geometry.h"
#include "base/image.h"
#include "pipeline/preprocess/plane_search.h"
#include "pipeline/preprocess/working_depth.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Rectangle of pixels, the upper bounds excluded.
struct PixelBox {
  int u0 = 0;
  int v0 = 0;
  int u1 = 0;
  int v1 = 0;

  [[nodiscard]] int width() const noexcept { return u1 - u0; }
  [[nodiscard]] int height() const noexcept { return v1 - v0; }
  [[nodiscard]] bool contains(int u, int v) const noexcept {
    return u >= u0 && v >= v0 && u < u1 && v < v1;
  }
};

/// Random error of a depth reading: sigma = sigma_per_m2 · z² (Khoshelham and Elberink 2012), never
/// below what the sampling itself can tell.
struct DepthNoise {
  float sigma_per_m2 = 1.425e-3F;
  float floor_m = 0.0F;

  [[nodiscard]] float sigma_m(float z_m) const noexcept {
    const float sigma = sigma_per_m2 * z_m * z_m;
    return sigma > floor_m ? sigma : floor_m;
  }
};

/// What a camera saw, for tests by projection: depth, which pixels belong to which object, and the
/// object's working surface for its normals. Owns nothing.
struct DepthView {
  Intrinsics intrinsics;
  ImageView<const std::uint16_t> depth;  ///< counts, 0 = no reading
  float metres_per_unit = 0.001F;
  ImageView<const std::uint8_t> label;  ///< 0 = background; empty = all are foreground
  std::uint8_t object = 0;              ///< label under test; 0 = any foreground
  const DepthPlane* belt = nullptr;     ///< its normal and offset, where one is known
  /// Bit i: label i + 1 is large enough to be a thing of its own; others are fragments.
  std::uint32_t things = 0xffffffffU;
  DepthNoise noise;
  PixelBox box;                      ///< tests look no further than this
  int stride = 1;                    ///< sensor pixels a pixel of this view
  const Surface* working = nullptr;  ///< organised, same camera; its own (coarser) grid

  /// Sensor pixels in the view's own, rounded up.
  [[nodiscard]] int own_px(int sensor_px) const noexcept {
    return (sensor_px + stride - 1) / stride;
  }
  [[nodiscard]] float z_m(int u, int v) const noexcept {
    return metres_per_unit * static_cast<float>(depth.at(u, v));
  }
  [[nodiscard]] bool background(int u, int v) const noexcept {
    return !label.empty() && label.at(u, v) == 0;
  }
  /// It and the next seven of its row are; false where the row has no eight more.
  [[nodiscard]] bool eight_background(int u, int v) const noexcept {
    return !label.empty() && u + 8 <= label.width && eight_labels(label.row(v) + u) == 0;
  }
  /// The pixel is of the object under test.
  [[nodiscard]] bool of_object(int u, int v) const noexcept {
    if (depth.at(u, v) == 0 || background(u, v)) return false;
    return object == 0 || label.empty() || label.at(u, v) == object;
  }
  /// The reading lies on the belt within `tolerance_m`.
  [[nodiscard]] bool on_belt(int u, int v, float tolerance_m) const noexcept {
    if (belt == nullptr || depth.at(u, v) == 0) return false;
    const Vec3d ray((u - intrinsics.cx) / intrinsics.fx, (v - intrinsics.cy) / intrinsics.fy, 1.0);
    const double height_m = static_cast<double>(z_m(u, v)) * belt->normal.dot(ray) + belt->offset_m;
    return std::fabs(height_m) <= static_cast<double>(tolerance_m);
  }
  /// The pixel is foreground that is neither of the object nor of another thing.
  [[nodiscard]] bool of_fragment(int u, int v) const noexcept {
    if (depth.at(u, v) == 0 || label.empty() || background(u, v) || of_object(u, v)) return false;
    const unsigned bit = label.at(u, v) - 1U;
    return bit >= 32U || (things >> bit & 1U) == 0;
  }
  /// Point of the working surface at a pixel, -1 = none.
  [[nodiscard]] std::int32_t working_point(int u, int v) const noexcept;
};

/// Part of a depth image, thinned to every stride-th pixel: what tests by projection need of a
/// large object, at a fraction of the cost.
class ThinnedDepth {
 public:
  void reserve(Arena& arena, std::size_t max_pixels);

  /// Replaces the view's image by the pixels of its box, every `stride`-th; intrinsics, box and
  /// stride follow. O(pixels of the box / stride²).
  void thin(DepthView& view, int stride) noexcept;

 private:
  std::span<std::uint16_t> depth_;
  std::span<std::uint8_t> label_;
};

/// The least step in depth that counts as an edge at a depth.
[[nodiscard]] float edge_step_m(const DepthView& view, float z_m) noexcept;

/// Depth edges of a view, one bit a pixel, and the nearest of them to a place.
class EdgeMap {
 public:
  void reserve(Arena& arena, std::size_t max_pixels);

  /// A pixel is an edge when it belongs to the foreground and the next reading on one of its four
  /// sides is background, or lies behind it by more than the noise and a steep surface explain. A
  /// gap without reading may lie between (the projector's shadow); where nothing is read beyond,
  /// nothing is known and there is no edge. O(pixels of the box).
  void build(const DepthView& view) noexcept;

  struct Nearest {
    int u = 0;
    int v = 0;
    int square = 0;  ///< distance², px²
    bool found = false;
  };
  /// The nearest edge within `reach` pixels; of equally near ones the same on every call. Nothing
  /// is found for a pixel outside of the box. O(reach).
  [[nodiscard]] Nearest nearest(int u, int v, double reach) const noexcept;

 private:
  using Word = std::uint64_t;

  /// Sets the pixel's bit if it is an edge.
  void mark(const DepthView& view, int u, int v) noexcept;
  /// Offers `nearest` the nearest edges of row `v`, at most `limit` px² from (u, v - off).
  void look_along(int u, int v, int off, int& limit, Nearest& nearest) const noexcept;

  PixelBox box_;
  std::span<Word> bits_;  // of the box, row after row without a gap
};

}  // namespace grapnel
