#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/error.h"
#include "pipeline/kernels/range_rows.h"
#include "pipeline/surface.h"

namespace grapnel {

/// A surface as a pinhole camera sees it: points in the camera's frame, a pixel each. A rim of
/// unobserved pixels about it has elements in every plane, so that no window has a bound to check.
struct RangeImage {
  /// What a pixel holds. Filled: no reading, but the surface behind is known (see fill_shadows).
  enum class Pixel : std::uint8_t { Unobserved, Far, Filled, Point };

  static constexpr int kRim = kernels::kRangeReach;
  static constexpr float kNowhere_m = 1e15F;
  static constexpr float kFar_m = 2e15F;

  int width = 0;  ///< without the rim
  int height = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;
  double resolution_rad = 0.0;                ///< angle of a pixel at the middle
  float nearest_m = 0.0F, farthest_m = 0.0F;  ///< range of the points of what `see` saw
  /// Metres; range is the distance from the camera. Without coordinates x holds kNowhere_m or,
  /// where far, kFar_m, the others zero.
  std::span<float> x, y, z, range;
  std::span<Pixel> kind;
  std::span<std::int32_t> point;  ///< of the surface; -1 for none

  void reserve(Arena& arena, std::size_t max_pixels);

  /// Elements from a row to the next.
  [[nodiscard]] int stride() const noexcept { return width + 2 * kRim; }
  /// Elements of a plane, rim included.
  [[nodiscard]] std::size_t pixels() const noexcept {
    return static_cast<std::size_t>(stride()) * static_cast<std::size_t>(height + 2 * kRim);
  }
  [[nodiscard]] bool inside(int u, int v) const noexcept {
    return u >= 0 && v >= 0 && u < width && v < height;
  }
  [[nodiscard]] std::size_t at(int u, int v) const noexcept {
    return static_cast<std::size_t>((v + kRim) * stride() + u + kRim);
  }
  [[nodiscard]] int column_of(std::size_t pixel) const noexcept {
    return static_cast<int>(pixel) % stride() - kRim;
  }
  [[nodiscard]] int row_of(std::size_t pixel) const noexcept {
    return static_cast<int>(pixel) / stride() - kRim;
  }
  /// Has coordinates.
  [[nodiscard]] bool valid(std::size_t pixel) const noexcept {
    return kind[pixel] >= Pixel::Filled;
  }
  [[nodiscard]] bool valid(int u, int v) const noexcept { return inside(u, v) && valid(at(u, v)); }
  [[nodiscard]] Vec3d place(std::size_t pixel) const noexcept {
    return Vec3f(x[pixel], y[pixel], z[pixel]).cast<double>();
  }
};

/// The surface's grid where it has one with intrinsics, cut to the pixels with points; else its
/// projection on a camera at its viewpoint, or three of its radii before its centre, its pixels 1.5
/// spacings wide. Errors: TooFewPoints, CapacityExceeded (more pixels than fit).
[[nodiscard]] Status see(const Surface& surface, RangeImage& image) noexcept;

/// Gives pixels without reading what lies behind them: in a row, between two points at most
/// `max_gap_px` apart, the farther one's depth (structured light's shadow lies on the background);
/// everything else becomes far.
void fill_shadows(RangeImage& image, int max_gap_px) noexcept;

/// Half the width and height: of each four pixels the nearest observed one (PCL's getHalfImage).
void halve(const RangeImage& from, RangeImage& to) noexcept;

/// Rows top … bottom - 1 of an image, in its memory: other rows of it are their rim.
[[nodiscard]] RangeImage rows_of(const RangeImage& image, int top, int bottom) noexcept;

}  // namespace grapnel
