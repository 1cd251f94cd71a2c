#include "pipeline/keypoints/uniform.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace grapnel {

FieldTable uniform_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&UniformParams::cell_m>("cell_m", "m", 0.0, 10.0,
                                           "one keypoint a cell of this edge; 0 = by cell_ratio"),
      number_field<&UniformParams::cell_ratio>("cell_ratio", "spacings", 0.5, 1000.0,
                                               "edge of a cell"),
      bool_field<&UniformParams::need_normal>("need_normal", "only points that have a normal"),
  };
  return kFields;
}

namespace {

/// Cells per axis to either side of the origin that a key tells apart.
constexpr double kHalfCells = 1048575.0;

}  // namespace

void UniformDetector::reserve(Arena& arena, const Limits& limits) {
  entries_ = arena.take<Entry>(std::max(limits.max_points, limits.max_model_points));
}

std::size_t UniformDetector::choose(const Surface& surface, double cell_m) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < surface.size; ++i) {
    if (params_.need_normal && !surface.has_normal(i)) continue;
    const Vec3d p = surface.point(i).cast<double>() / cell_m;
    Entry entry;
    entry.point = static_cast<std::int32_t>(i);
    double squared = 0.0;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double cell = std::clamp(std::floor(p[axis]), -kHalfCells, kHalfCells);
      const double off = p[axis] - cell - 0.5;
      squared += off * off;
      entry.cell = (entry.cell << 21) | static_cast<std::uint64_t>(cell + kHalfCells);
    }
    entry.off_centre = static_cast<float>(squared);
    entries_[count++] = entry;
  }
  const auto begin = entries_.begin();
  const auto end = begin + static_cast<std::ptrdiff_t>(count);
  std::sort(begin, end, [](const Entry& a, const Entry& b) {
    if (a.cell != b.cell) return a.cell < b.cell;
    return a.off_centre != b.off_centre ? a.off_centre < b.off_centre : a.point < b.point;
  });
  const auto last =
      std::unique(begin, end, [](const Entry& a, const Entry& b) { return a.cell == b.cell; });
  return static_cast<std::size_t>(last - begin);
}

Status UniformDetector::detect(const Surface& surface, KeypointSet& keypoints) noexcept {
  keypoints.clear();
  if (surface.size == 0) return Error{Code::TooFewPoints, Stage::Keypoints, 0};
  if (surface.size > entries_.size()) {
    return Error{Code::CapacityExceeded, Stage::Keypoints, static_cast<std::int32_t>(surface.size)};
  }
  if (!surface.all_finite()) return Error{Code::BadParameter, Stage::Keypoints, 0};
  double cell = params_.cell_m > 0.0 ? params_.cell_m : params_.cell_ratio * surface.spacing_m;
  if (!(cell > 0.0)) return Error{Code::BadParameter, Stage::Keypoints, 0};
  std::size_t count = choose(surface, cell);
  const bool too_many = count > keypoints.capacity();
  while (count > keypoints.capacity()) {
    const double excess = static_cast<double>(count) /
                          static_cast<double>(std::max<std::size_t>(1, keypoints.capacity()));
    cell *= 1.02 * std::sqrt(excess);
    count = choose(surface, cell);
  }
  std::sort(entries_.begin(), entries_.begin() + static_cast<std::ptrdiff_t>(count),
            [](const Entry& a, const Entry& b) { return a.point < b.point; });
  for (std::size_t i = 0; i < count; ++i) {
    keypoints.push_back({entries_[i].point, 1.0F, static_cast<float>(cell)});
  }
  if (too_many) keypoints.mark_overflowed();
  return {};
}

}  // namespace grapnel
