#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "pipeline/kernels/moved.h"
#include "pipeline/stage.h"
#include "pipeline/surface.h"

namespace grapnel {

/// Closest surface point by look-up: a voxel grid around the surface, each voxel holding the index
/// of the point nearest to its centre (a feature transform; the separable exact distance transform
/// of Felzenszwalb and Huttenlocher 2012, with the index carried along). Fixed memory.
class ClosestPointTable final : public ClosestSurface {
 public:
  /// Room for `max_voxels` voxels. A surface of more than 65535 points can't be indexed.
  void reserve(Arena& arena, std::size_t max_voxels);

  /// Indexes `surface`, which must stay where it is, with a margin on every side. O(voxels).
  void build(const Surface& surface, double margin_m) noexcept;
  /// Sooner, for surfaces that are indexed anew for each job: with a margin of `reach_m`, and right
  /// as far from the surface as that. A voxel farther away names any point. O(voxels × reach).
  void build_within(const Surface& surface, double reach_m) noexcept;

  /// The nearest of the candidates that the eight voxels around `p` name; -1 beyond
  /// `max_distance_m`, and outside of the grid.
  [[nodiscard]] std::int32_t closest(const Vec3f& p, float max_distance_m) const noexcept override;

  void closest_of_each(const float* x, const float* y, const float* z, std::size_t count,
                       float max_distance_m, std::int32_t* found) const noexcept override;

  /// The candidate of the voxel that holds `p`, one look-up; its distance is not checked. -1
  /// outside of the grid.
  [[nodiscard]] std::int32_t nearby(const Vec3f& p) const noexcept;

  /// The same for many points.
  void nearby_of_each(const float* x, const float* y, const float* z, std::size_t count,
                      float max_distance_m, std::int32_t* found) const noexcept override;

  /// For kernels: the voxels, and the point that each names.
  [[nodiscard]] kernels::VoxelShape voxels() const noexcept;
  [[nodiscard]] const std::uint16_t* named() const noexcept { return nearest_.data(); }

  [[nodiscard]] double voxel_m() const noexcept { return voxel_m_; }

 private:
  void shape(const Surface& surface, double margin_m, double least_voxel_m) noexcept;
  [[nodiscard]] std::size_t voxel_count() const noexcept;
  /// Calls `claim` with each point, its voxel and its distance² from that's centre, in voxels.
  template <class Claim>
  void for_seeds(const Claim& claim) noexcept;
  void seed() noexcept;
  void sweep(int axis) noexcept;

  const Surface* surface_ = nullptr;
  std::span<std::uint16_t> nearest_;
  // While it is built: a voxel's claim, or as a float's bits the distance² of its centre to its
  // seed's voxel, in voxels.
  std::span<std::uint32_t> work_;
  std::array<int, 3> size_{};
  Vec3f origin_ = Vec3f::Zero();
  float per_metre_ = 0.0F;
  double voxel_m_ = 0.0;
};

}  // namespace grapnel
