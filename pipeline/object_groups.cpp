#include "pipeline/object_groups.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace grapnel {
namespace {

// Pieces this near to each other in the image may be one part, in diameters.
constexpr double kGap = 0.06;
// A part reaches this far from the middle of what is seen of it, in diameters.
constexpr double kReach = 0.65;
// Coarser steps than this miss no part's end.
constexpr int kStep_px = 3;

bool is_component(std::uint8_t label) noexcept { return label != 0 && label <= kMaxComponents; }

}  // namespace

void ObjectGroups::reserve(Arena& arena, const Limits& limits) {
  own_label_ = arena.take<std::uint8_t>(static_cast<std::size_t>(limits.max_width) *
                                        static_cast<std::size_t>(limits.max_height));
}

void ObjectGroups::find_neighbours(const WorkingDepth& work, const Components& components,
                                   int gap_px) noexcept {
  std::fill(std::begin(beside_), std::end(beside_), 0U);
  if (components.size() < 2) return;
  Component all = components[0];
  for (const Component& piece : components) {
    all.left = std::min(all.left, piece.left);
    all.top = std::min(all.top, piece.top);
    all.right = std::max(all.right, piece.right);
    all.bottom = std::max(all.bottom, piece.bottom);
  }
  const auto note = [&](std::uint8_t a, std::uint8_t b) {
    if (a == b || !is_component(b)) return;
    beside_[a - 1] |= 1U << (b - 1);
    beside_[b - 1] |= 1U << (a - 1);
  };
  for (int gap = 1; gap <= gap_px; gap *= 2) {
    for (int v = all.top; v < all.bottom; ++v) {
      const std::uint8_t* row = work.label.row(v);
      const std::uint8_t* below = v + gap < work.label.height ? work.label.row(v + gap) : row;
      for (int u = all.left; u < all.right; ++u) {
        if (u + gap + 8 <= work.label.width) {
          // Eight at a time: nothing there, or nothing but one object as far as the gap.
          const std::uint64_t here = eight_labels(row + u);
          if (here == 0 ||
              (here == eight_labels(below + u) && here == eight_labels(row + u + gap))) {
            u += 7;
            continue;
          }
        }
        if (!is_component(row[u])) continue;
        note(row[u], below[u]);
        if (u + gap < work.label.width) note(row[u], row[u + gap]);
      }
    }
  }
}

ObjectGroup ObjectGroups::join(const Components& components, std::uint32_t members,
                               const WorkingDepth& work) const noexcept {
  ObjectGroup group;
  group.members = members;
  Component& whole = group.whole;
  whole.left = work.depth.width;
  whole.top = work.depth.height;
  for (std::size_t i = 0; i < components.size(); ++i) {
    if ((members >> i & 1U) == 0) continue;
    const Component& piece = components[i];
    if (group.label == 0) group.label = static_cast<std::uint8_t>(i + 1);
    const double before = static_cast<double>(whole.pixels);
    const double added = static_cast<double>(piece.pixels);
    const double share = added / (before + added);
    whole.pixels += piece.pixels;
    whole.area_m2 += piece.area_m2;
    whole.left = std::min(whole.left, piece.left);
    whole.top = std::min(whole.top, piece.top);
    whole.right = std::max(whole.right, piece.right);
    whole.bottom = std::max(whole.bottom, piece.bottom);
    whole.mean_depth_m += share * (piece.mean_depth_m - whole.mean_depth_m);
    whole.centre += static_cast<float>(share) * (piece.centre - whole.centre);
    whole.touches_edge = whole.touches_edge || piece.touches_edge;
  }
  return group;
}

double ObjectGroups::radius_m(const WorkingDepth& work, const ObjectGroup& group) const noexcept {
  const Vec3d centre = group.whole.centre.cast<double>();
  double square = 0.0;
  for (int v = group.whole.top; v < group.whole.bottom; v += kStep_px) {
    for (int u = group.whole.left; u < group.whole.right; u += kStep_px) {
      const std::uint8_t label = work.label.at(u, v);
      if (!is_component(label) || (group.members >> (label - 1) & 1U) == 0) continue;
      const double z = work.depth_m(u, v);
      const Vec3d p((u - work.intrinsics.cx) / work.intrinsics.fx * z,
                    (v - work.intrinsics.cy) / work.intrinsics.fy * z, z);
      square = std::max(square, (p - centre).squaredNorm());
    }
  }
  return std::sqrt(square);
}

void ObjectGroups::find(const WorkingDepth& work, const Components& components,
                        const Bounds& bounds) noexcept {
  const auto fits = [&](double area_m2) {
    return area_m2 >= bounds.min_area_m2 && area_m2 <= bounds.max_area_m2;
  };
  groups_.clear();
  oversized_.clear();
  for (int v = 0; v < work.label.height; ++v) {
    std::copy_n(work.label.row(v), work.label.width,
                own_label_.data() + static_cast<std::ptrdiff_t>(v) * work.label.width);
  }
  if (components.empty()) return;
  const double pixels_per_m = work.intrinsics.fx / components[0].mean_depth_m;
  find_neighbours(work, components,
                  std::max(4, static_cast<int>(kGap * bounds.diameter_m * pixels_per_m)));
  std::uint32_t taken = 0;
  for (std::size_t i = 0; i < components.size(); ++i) {
    if ((taken >> i & 1U) != 0) continue;
    std::uint32_t members = 1U << i;
    for (std::size_t j = i + 1; j < components.size(); ++j) {
      if ((taken >> j & 1U) != 0 || (beside_[j] & members) == 0) continue;
      const ObjectGroup larger = join(components, members | 1U << j, work);
      if (radius_m(work, larger) <= kReach * bounds.diameter_m) members = larger.members;
    }
    if (members == 1U << i) continue;
    taken |= members;
    const ObjectGroup group = join(components, members, work);
    if (fits(group.whole.area_m2)) groups_.push_back(group);
  }
  for (std::size_t i = 0; i < components.size(); ++i) {
    const ObjectGroup own = join(components, 1U << i, work);
    if (own.whole.area_m2 > bounds.max_area_m2) oversized_.push_back(own);
    if (fits(own.whole.area_m2)) groups_.push_back(own);
  }
}

void ObjectGroups::select(const ObjectGroup& group, WorkingDepth& work) noexcept {
  for (int v = 0; v < work.label.height; ++v) {
    const std::uint8_t* own = own_label_.data() + static_cast<std::ptrdiff_t>(v) * work.label.width;
    std::copy_n(own, work.label.width, work.label.row(v));
  }
  for (int v = group.whole.top; v < group.whole.bottom; ++v) {
    std::uint8_t* row = work.label.row(v);
    for (int u = group.whole.left; u < group.whole.right; ++u) {
      if (is_component(row[u]) && (group.members >> (row[u] - 1) & 1U) != 0) row[u] = group.label;
    }
  }
}

}  // namespace grapnel
