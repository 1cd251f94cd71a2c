#include "pipeline/descriptors/pfh.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/math.h"
#include "pipeline/descriptors/common.h"
#include "pipeline/descriptors/pair_feature.h"

namespace grapnel {

FieldTable pfh_fields() noexcept {
  using P = PfhParams;
  static constexpr std::array kFields = {
      number_field<&P::radius_m>("radius_m", "m", 0.0, 10.0,
                                 "described surroundings; 0 = radius_ratio spacings"),
      number_field<&P::radius_ratio>("radius_ratio", "", 1.0, 100.0,
                                     "described surroundings in spacings"),
      number_field<&P::bins>("bins", "", 2, 8, "of each of the three features"),
      number_field<&P::max_neighbours>(
          "max_neighbours", "", 0, 100000,
          "of one keypoint, thinned evenly beyond; 0 = the preset's limit (PCL: no limit)"),
      choice_field<&P::engine>("engine", kEngineNames, "fast, or plain loops in double"),
  };
  return kFields;
}

std::size_t PfhEstimator::dimension() const noexcept {
  const auto bins = static_cast<std::size_t>(params_.bins);
  return bins * bins * bins;
}

void PfhEstimator::reserve(Arena& arena, const Limits& limits) {
  max_neighbours_ = params_.max_neighbours > 0 ? static_cast<std::size_t>(params_.max_neighbours)
                                               : limits.max_neighbours;
  search_.reserve(arena, limits);
  for (std::span<float>& plane : around_) {
    plane = arena.take<float>(max_neighbours_ + kernels::kSlack);
  }
  for (std::span<std::uint32_t>& table : counts_) {
    table = arena.take<std::uint32_t>(dimension() + 1);
  }
}

std::size_t PfhEstimator::gather(const Surface& surface, std::size_t point_i,
                                 float radius_m) noexcept {
  const Neighbourhood around = search_.thin(search_.within(point_i, radius_m), max_neighbours_);
  const std::array<std::span<const float>, 6> from = {surface.x,  surface.y,  surface.z,
                                                      surface.nx, surface.ny, surface.nz};
  std::size_t count = 0;
  for (const std::int32_t index : around.index) {
    const auto other = static_cast<std::size_t>(index);
    if (!surface.has_normal(other)) continue;
    for (std::size_t plane = 0; plane < 6; ++plane) around_[plane][count] = from[plane][other];
    ++count;
  }
  return count;
}

void PfhEstimator::count_fast(std::size_t count) noexcept {
  const kernels::OrientedPlanes points{around_[0].data(), around_[1].data(), around_[2].data(),
                                       around_[3].data(), around_[4].data(), around_[5].data()};
  kernels::PairCellCounts counts;
  for (std::size_t i = 0; i < counts_.size(); ++i) counts.table[i] = counts_[i].data();
  kernels::count_pair_cells(points, count, params_.bins, counts);
}

void PfhEstimator::count_plain(std::size_t count) noexcept {
  const auto bins = static_cast<std::size_t>(params_.bins);
  const auto vector = [&](std::size_t plane, std::size_t i) {
    const auto part = [&](std::size_t axis) {
      return static_cast<double>(around_[plane + axis][i]);
    };
    return Vec3d(part(0), part(1), part(2));
  };
  for (std::size_t i = 1; i < count; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const PairFeature pair = pair_feature(vector(0, i), vector(3, i), vector(0, j), vector(3, j));
      if (!pair.valid) continue;
      const std::size_t cell =
          bin_of(pair.f1_rad, -math::kPi, math::kPi, bins) +
          bins * (bin_of(pair.f2, -1.0, 1.0, bins) + bins * bin_of(pair.f3, -1.0, 1.0, bins));
      ++counts_[0][cell];
    }
  }
}

Status PfhEstimator::describe(const Surface& surface, std::span<const Keypoint> keypoints,
                              FeatureMatrix& features) noexcept {
  const Result<float> radius_m = begin_description(
      surface, keypoints, params_.radius_m, params_.radius_ratio, dimension(), features, search_);
  if (!radius_m.ok()) return radius_m.error();
  for (std::size_t k = 0; k < keypoints.size(); ++k) {
    const auto point_i = static_cast<std::size_t>(keypoints[k].point);
    if (!surface.has_normal(point_i)) continue;
    const std::size_t count = gather(surface, point_i, radius_m.value());
    if (count < 2) continue;
    for (const std::span<std::uint32_t> table : counts_) std::ranges::fill(table, 0U);
    params_.engine == Engine::Fast ? count_fast(count) : count_plain(count);
    // Of all pairs, also those that turn out to have no features.
    const auto pairs = static_cast<double>(count * (count - 1) / 2);
    const std::span<float> row = features.row(k);
    for (std::size_t cell = 0; cell < row.size(); ++cell) {
      std::uint32_t sum = 0;
      for (const std::span<std::uint32_t> table : counts_) sum += table[cell];
      row[cell] = static_cast<float>(100.0 * static_cast<double>(sum) / pairs);
    }
  }
  return {};
}

}  // namespace grapnel
