#include "pipeline/preprocess/depth_outliers.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "pipeline/kernels/depth_rows.h"

namespace grapnel {
namespace {

// Pixels of a row that are looked at in one comparison.
constexpr int kStretch_px = 32;

/// The depth of the surface that most of the eight neighbours lie on; 0 where the middle one does
/// not lie between them, fewer than `min_support` do, or two surfaces share them evenly.
std::uint16_t surface_beside(const std::uint16_t* const rows[3], const DepthGap& gap,
                             int min_support) noexcept {
  std::array<std::uint16_t, 8> depth{};  // in ascending order
  std::size_t count = 0;
  for (int i = 0; i < 9; ++i) {
    const std::uint16_t other = rows[i / 3][i % 3];
    if (i == 4 || other == 0) continue;
    std::size_t k = count++;
    for (; k > 0 && depth[k - 1] > other; --k) depth[k] = depth[k - 1];
    depth[k] = other;
  }
  const std::uint16_t own = rows[1][1];
  if (count < 2 || own <= depth[0] || own >= depth[count - 1]) return 0;
  std::size_t most = 0;
  std::size_t second = 0;
  std::uint16_t middle = 0;
  for (std::size_t first = 0, end = 0; first < count; first = end) {
    end = first + 1;
    while (end < count && gap.continuous(depth[end - 1], depth[end])) ++end;
    const std::size_t size = end - first;
    second = std::max(second, std::min(most, size));
    if (size <= most) continue;
    most = size;
    middle = depth[first + (size - 1) / 2];
  }
  return most > second && most >= static_cast<std::size_t>(min_support) ? middle : std::uint16_t{0};
}

}  // namespace

FieldTable depth_outlier_fields() noexcept {
  static constexpr std::array kFields = {
      bool_field<&DepthOutlierParams::enabled>(
          "enabled", "remove flying and grazing pixels, put mixed ones on a surface"),
      number_field<&DepthOutlierParams::min_support>(
          "min_support", "", 0, 8, "of the eight neighbours, how many must lie on the surface"),
  };
  return kFields;
}

void DepthOutliers::reserve(Arena& arena, const Limits& limits) { padded_.reserve(arena, limits); }

std::size_t DepthOutliers::apply(WorkingDepth& work) noexcept {
  if (!params_.enabled) return 0;
  const DepthGap gap(params_.gap, work.intrinsics, work.metres_per_unit);
  padded_.copy(work.depth);
  std::size_t removed = 0;
  for (int v = 0; v < work.depth.height; ++v) {
    const std::size_t in_row = kernels::support_row(
        padded_.row(v - 1, 1), padded_.row(v, 1), padded_.row(v + 1, 1), gap.law(),
        params_.min_support, static_cast<std::size_t>(work.depth.width), work.depth.row(v));
    if (in_row > 0) removed += in_row - put_on_surfaces(gap, v, work);
  }
  return removed;
}

std::size_t DepthOutliers::put_on_surfaces(const DepthGap& gap, int v,
                                           WorkingDepth& work) const noexcept {
  std::uint16_t* row = work.depth.row(v);
  const std::uint16_t* read = padded_.row(v, 0);
  std::size_t put = 0;
  for (int begin = 0; begin < work.depth.width; begin += kStretch_px) {
    const int end = std::min(begin + kStretch_px, work.depth.width);
    if (std::equal(row + begin, row + end, read + begin)) continue;
    for (int u = begin; u < end; ++u) {
      if (row[u] == read[u]) continue;
      const std::uint16_t* const beside[3] = {padded_.row(v - 1, 1) + u, padded_.row(v, 1) + u,
                                              padded_.row(v + 1, 1) + u};
      row[u] = surface_beside(beside, gap, params_.min_support);
      put += row[u] != 0 ? 1U : 0U;
      if (row[u] == 0) work.label.row(v)[u] = kNoLabel;
    }
  }
  return put;
}

}  // namespace grapnel
