#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/error.h"
#include "pipeline/kernels/eigenvalues.h"
#include "pipeline/kernels/window_sums.h"
#include "pipeline/limits.h"
#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Sums over the spheres around all points of a surface: one pass over the windows of a camera's
/// grid where it has one, cells otherwise. Float: right to about 1e-6 of the largest product.
class SphereSums {
 public:
  /// Elements behind the last point that may be read in every plane.
  static constexpr std::size_t kPadding = 16;

  void reserve(Arena& arena, const Limits& limits);

  /// For spheres of `radius_m` > 0; the surface must stay as it is until the next build.
  /// Errors: TooFewPoints, CapacityExceeded. O(n + grid).
  [[nodiscard]] Status build(const Surface& surface, double radius_m) noexcept;
  /// Of the surface given to build.
  [[nodiscard]] NeighbourSearch& search() noexcept { return search_; }

  /// Number of points in each sphere and scatter about its centre (not divided by anything);
  /// `with_mean`: the sums of the offsets too.
  void scatter(bool with_mean) noexcept;
  /// Number of points with normal and the sums of their normals and products. `about_own`: of the
  /// differences to the centre's normal.
  void normals(bool about_own) noexcept;

  /// Results, in the order of the points.
  [[nodiscard]] std::span<const float> count() const noexcept { return plane(kCount); }
  [[nodiscard]] std::span<const float> first(std::size_t axis) const noexcept {
    return plane(kFirst + axis);
  }
  /// Entry xx, xy, xz, yy, yz or zz of the products.
  [[nodiscard]] std::span<const float> product(std::size_t entry) const noexcept {
    return plane(kProducts + entry);
  }
  [[nodiscard]] kernels::SymmetricPlanes products() const noexcept;

 private:
  static constexpr std::size_t kCount = 0;
  static constexpr std::size_t kFirst = 1;
  static constexpr std::size_t kProducts = 4;
  static constexpr std::size_t kPlanes = 10;
  static constexpr int kMaxHalf = 40;  ///< pixels; larger windows go point by point

  enum class What : std::uint8_t { Scatter, ScatterAndMean, Normals, NormalsAboutOwn };

  [[nodiscard]] std::span<const float> plane(std::size_t i) const noexcept {
    return sums_[i].first(surface_->size);
  }
  [[nodiscard]] bool spread_out() noexcept;
  void fill_dense() noexcept;
  [[nodiscard]] double reach_px(std::size_t point_i) const noexcept;
  void run(What what) noexcept;
  void over_windows(What what) noexcept;
  void block(What what, std::size_t begin, std::size_t end, int block_u, int row) noexcept;
  void over_points(What what) noexcept;

  const Surface* surface_ = nullptr;
  double radius_m_ = 0.0;
  NeighbourSearch search_;
  std::array<std::span<float>, kPlanes> sums_;

  bool dense_ = false;
  int left_ = 0, top_ = 0, width_ = 0, height_ = 0;  ///< of the pixels with points
  int border_ = 0;
  std::ptrdiff_t stride_ = 0;
  std::array<std::span<float>, 7> dense_planes_;  ///< x, y, z, nx, ny, nz, weight
  std::array<std::span<float>, 4> ordered_;       ///< normals and weight in the search's order
};

}  // namespace grapnel
