#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/error.h"
#include "pipeline/kernels/block_pairs.h"
#include "pipeline/kernels/block_sums.h"
#include "pipeline/kernels/window_sums.h"
#include "pipeline/limits.h"
#include "pipeline/neighbours/cell_index.h"
#include "pipeline/neighbours/symmetric3.h"
#include "pipeline/neighbours/window_index.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Points around a place, by index, with their squared distances (m²).
struct Neighbourhood {
  std::span<const std::int32_t> index;
  std::span<const float> squared_m2;
  [[nodiscard]] std::size_t size() const noexcept { return index.size(); }
};

/// Exact radius search over a surface: windows of a camera's grid where its points project to their
/// pixels, cells of a cloud otherwise. Every method asks here, so that it is written once for both.
/// The order of the neighbours is fixed: ascending index on a grid, cell by cell otherwise.
class NeighbourSearch {
 public:
  /// For surfaces of up to `max_points` points and `max_grid_pixels` (0: clouds only).
  void reserve(Arena& arena, std::size_t max_points, std::size_t max_grid_pixels);
  /// For any surface a preset's limits allow.
  void reserve(Arena& arena, const Limits& limits);

  /// `radius_m` > 0 is the radius that will be asked for most; others work too. The surface must
  /// stay as it is until the next build. Errors: TooFewPoints, CapacityExceeded, BadParameter (a
  /// coordinate is not finite). O(n + grid).
  [[nodiscard]] Status build(const Surface& surface, double radius_m) noexcept;

  /// Points within `radius_m` of a point, itself included. Valid until the next call.
  [[nodiscard]] Neighbourhood within(std::size_t point_i, float radius_m) noexcept;
  /// The same around any place.
  [[nodiscard]] Neighbourhood within(const Vec3f& place, float radius_m) noexcept;
  /// The same around the point at a position of the search's order (point_at), as positions.
  [[nodiscard]] Neighbourhood near_position(std::size_t position, float radius_m) noexcept;
  /// Coordinates in the order of the positions.
  [[nodiscard]] kernels::PointPlanes planes() const noexcept {
    return {x_.data(), y_.data(), z_.data()};
  }
  /// The `count` nearest points (fewer when the surface has fewer), nearest first, ties by index.
  [[nodiscard]] Neighbourhood nearest(const Vec3f& place, std::size_t count) noexcept;

  /// Number, sums and sums of products of the offsets to all points within, in metres; the fast way
  /// to a neighbourhood's scatter. Float: right to about 1e-6 of the largest product.
  [[nodiscard]] kernels::SphereMoments moments(std::size_t point_i, float radius_m) const noexcept;

  /// The points from a position on, at most kernels::kBlock, that lie within a box of the radius.
  [[nodiscard]] kernels::BlockOfPoints block_from(std::size_t position,
                                                  float radius_m) const noexcept;
  /// The same as moments() of each of a block's points: what lies near them is looked up once.
  void block_moments(const kernels::BlockOfPoints& block, float radius_m,
                     float (*sums)[kernels::kBlock]) const noexcept;

  /// The points within `radius_m` of each of a block's points, as positions; false where `near` has
  /// no room for them.
  [[nodiscard]] bool near_block(const kernels::BlockOfPoints& block, float radius_m,
                                kernels::NearBlock& near) const noexcept;

  /// Whether a point within `radius_m` of the point at a position of the search's order has a
  /// larger value than it; `values` in that order with kernels::kSlack elements behind. Stops at
  /// the first one.
  [[nodiscard]] bool exceeded(std::size_t position, float radius_m,
                              const float* values) const noexcept;

  /// The search's order: index of the point at a position, 0…size - 1. Neighbours lie near.
  [[nodiscard]] std::size_t point_at(std::size_t position) const noexcept {
    return on_grid_ ? position
                    : static_cast<std::size_t>(cells_.point(static_cast<std::int32_t>(position)));
  }

  /// Keeps `count` of the last neighbours, spread evenly over their list in place of cutting its
  /// end. The list itself when it is not longer.
  [[nodiscard]] Neighbourhood thin(Neighbourhood found, std::size_t count) noexcept;

  [[nodiscard]] bool uses_grid() const noexcept { return on_grid_; }
  /// How far the grid's points lie from their pixels' centres; uses_grid() only.
  [[nodiscard]] double grid_slack_px() const noexcept { return window_.slack_px(); }

 private:
  struct Corners {
    Vec3f low, high;
  };
  /// Of a block's points.
  [[nodiscard]] Corners corners(const kernels::BlockOfPoints& block) const noexcept;
  void copy_points(const Surface& surface) noexcept;
  /// Positions in the sphere, left in index_ with their squared distances. Returns their number.
  std::size_t select(const Vec3f& place, float radius_m) noexcept;
  /// Stretches of points that may lie within the radius of a place between two corners, in batches
  /// to `use(span of PointRange)`.
  template <class Use>
  void for_ranges(const Corners& corners, float radius_m, const Use& use) const noexcept;
  /// The same of a box of cells.
  template <class Use>
  void for_rows(const CellIndex::Box& box, const Use& use) const noexcept;

  const Surface* surface_ = nullptr;
  bool on_grid_ = false;
  float typical_radius_m_ = 0.0F;
  WindowIndex window_;
  CellIndex cells_;
  float reach_m_ = 0.0F;        ///< diagonal of the surface's box: no point is farther from another
  std::span<float> x_, y_, z_;  ///< copies in the index's order, with slack behind
  std::span<std::int32_t> index_;
  std::span<float> squared_m2_;
  std::span<std::uint64_t> by_distance_;
};

/// Sums of products about the point.
[[nodiscard]] Symmetric3 scatter(const kernels::SphereMoments& moments) noexcept;
/// Covariance about the neighbours' mean.
[[nodiscard]] Symmetric3 covariance(const kernels::SphereMoments& moments) noexcept;

/// Mean distance to the nearest other point over at most `samples` points spread evenly; 0 for
/// fewer than two points. What `spacing_m` of a cloud is set from.
[[nodiscard]] double mean_spacing_m(NeighbourSearch& search, const Surface& surface,
                                    std::size_t samples) noexcept;

}  // namespace grapnel
