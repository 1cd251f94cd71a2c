#include "pipeline/neighbours/point_blocks.h"

#include <algorithm>
#include <cmath>

namespace grapnel {

PointBlocks::PointBlocks(const kernels::PointPlanes& points, std::size_t size, float radius_m,
                         const std::array<std::span<float>, 7>& planes) noexcept
    : points_(points),
      size_(static_cast<std::int32_t>(size)),
      // A float's rounding more.
      reach_m2_(radius_m * radius_m * 1.0001F),
      planes_(planes) {
  for (std::int32_t begin = 0; begin < size_;) begin = add_block(begin, radius_m);
  for (std::int32_t begin = 0; begin < blocks_;) begin = add_group(begin, 4.0F * radius_m);
}

/// Takes points as long as they lie within a box of the radius. Returns where the block ends.
std::int32_t PointBlocks::add_block(std::int32_t begin, float radius_m) noexcept {
  const auto at = static_cast<std::size_t>(blocks_++);
  // Whole numbers below 2^24 are exact.
  planes_[kBegin][at] = static_cast<float>(begin);
  const std::array<const float*, 3> from = {points_.x, points_.y, points_.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    planes_[axis][at] = planes_[axis + 3][at] = from[axis][begin];
  }
  std::int32_t end = begin + 1;
  for (; end < size_ && end - begin < kernels::kBlock; ++end) {
    const bool within = std::all_of(from.begin(), from.end(), [&](const float* plane) {
      return std::fabs(plane[end] - plane[begin]) <= radius_m;
    });
    if (!within) break;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      planes_[axis][at] = std::min(planes_[axis][at], from[axis][end]);
      planes_[axis + 3][at] = std::max(planes_[axis + 3][at], from[axis][end]);
    }
  }
  planes_[kBegin][at + 1] = static_cast<float>(end);
  return end;
}

/// Takes blocks as long as they begin within the room. Returns where the group ends.
std::int32_t PointBlocks::add_group(std::int32_t begin, float room_m) noexcept {
  const auto first = static_cast<std::size_t>(begin);
  const std::size_t at = groups_at() + static_cast<std::size_t>(groups_++);
  for (std::size_t side = 0; side < kBegin; ++side) planes_[side][at] = planes_[side][first];
  std::size_t next = first + 1;
  for (; next < static_cast<std::size_t>(blocks_) && next - first < kGroup; ++next) {
    bool within = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      within = within && std::fabs(planes_[axis][next] - planes_[axis][first]) <= room_m;
    }
    if (!within) break;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      planes_[axis][at] = std::min(planes_[axis][at], planes_[axis][next]);
      planes_[axis + 3][at] = std::max(planes_[axis + 3][at], planes_[axis + 3][next]);
    }
  }
  planes_[kBegin][at] = static_cast<float>(begin);
  planes_[kBegin][at + 1] = static_cast<float>(next);
  return static_cast<std::int32_t>(next);
}

kernels::Box PointBlocks::box_at(std::size_t at) const noexcept {
  kernels::Box box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.low[axis] = planes_[axis][at];
    box.high[axis] = planes_[axis + 3][at];
  }
  return box;
}

std::span<const PointRange> PointBlocks::near(std::int32_t block_i) noexcept {
  if (block_i < group_blocks_.begin || block_i >= group_blocks_.end) {
    const std::int32_t after = block_i >= group_blocks_.end ? group_ + 1 : 0;
    for (group_ = after; members(group_).end <= block_i;) ++group_;
    group_blocks_ = members(group_);
    near_blocks_.clear();
    const PointRange all{0, groups_};
    kernels::near_members(boxes(groups_at()), planes_[kBegin].data() + groups_at(), {&all, 1},
                          box_at(groups_at() + static_cast<std::size_t>(group_)), reach_m2_,
                          near_blocks_);
  }
  near_points_.clear();
  kernels::near_members(boxes(0), planes_[kBegin].data(), near_blocks_.list(),
                        box_at(static_cast<std::size_t>(block_i)), reach_m2_, near_points_);
  return near_points_.list();
}

}  // namespace grapnel
