#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/kernels/block_sums.h"

namespace grapnel {

/// A cloud's points in blocks of neighbours, as they follow each other in the search's order, and
/// which other points may lie in a block's spheres: boxes about blocks, and about groups of blocks.
/// Lives in seven planes of somebody's memory, of two elements a point and 3 kSlack each.
class PointBlocks {
 public:
  /// For spheres of this radius about points in the search's order. O(n).
  PointBlocks(const kernels::PointPlanes& points, std::size_t size, float radius_m,
              const std::array<std::span<float>, 7>& planes) noexcept;

  [[nodiscard]] std::int32_t size() const noexcept { return blocks_; }
  [[nodiscard]] kernels::BlockOfPoints block(std::int32_t block_i) const noexcept {
    const std::int32_t begin = begin_of(block_i);
    return {begin, begin_of(block_i + 1) - begin};
  }
  /// Stretches that hold every point within a block's spheres, ascending. Valid until the next
  /// call; fast when the blocks are asked for one after the other.
  [[nodiscard]] std::span<const PointRange> near(std::int32_t block_i) noexcept;

 private:
  static constexpr std::size_t kGroup = 8;  ///< blocks, at most
  static constexpr std::size_t kBegin = 6;  ///< the plane that holds where blocks begin

  [[nodiscard]] std::size_t groups_at() const noexcept {
    return static_cast<std::size_t>(size_) + kernels::kSlack;
  }
  /// Position of a block's first point; of the one behind the last too.
  [[nodiscard]] std::int32_t begin_of(std::int32_t block_i) const noexcept {
    return static_cast<std::int32_t>(planes_[kBegin][static_cast<std::size_t>(block_i)]);
  }
  /// A group's blocks.
  [[nodiscard]] PointRange members(std::int32_t group) const noexcept {
    const std::size_t at = groups_at() + static_cast<std::size_t>(group);
    return {static_cast<std::int32_t>(planes_[kBegin][at]),
            static_cast<std::int32_t>(planes_[kBegin][at + 1])};
  }
  std::int32_t add_block(std::int32_t begin, float radius_m) noexcept;
  std::int32_t add_group(std::int32_t begin, float room_m) noexcept;
  [[nodiscard]] kernels::BoxPlanes boxes(std::size_t from) const noexcept {
    const auto side = [&](std::size_t i) { return planes_[i].data() + from; };
    return {side(0), side(1), side(2), side(3), side(4), side(5)};
  }
  [[nodiscard]] kernels::Box box_at(std::size_t at) const noexcept;

  kernels::PointPlanes points_;
  std::int32_t size_;
  float reach_m2_;
  std::array<std::span<float>, 7> planes_;
  std::int32_t blocks_ = 0;
  std::int32_t groups_ = 0;
  std::int32_t group_ = -1;  ///< whose near groups' blocks are known
  PointRange group_blocks_;
  kernels::Stretches near_blocks_;
  kernels::Stretches near_points_;
};

}  // namespace grapnel
