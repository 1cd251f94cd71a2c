#include "pipeline/descriptors/fpfh.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/math.h"
#include "pipeline/descriptors/common.h"
#include "pipeline/descriptors/pair_feature.h"
#include "pipeline/kernels/pair_features.h"

namespace grapnel {

FieldTable fpfh_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&FpfhParams::radius_m>("radius_m", "m", 0.0, 10.0,
                                          "described surroundings; 0 = radius_ratio spacings"),
      number_field<&FpfhParams::radius_ratio>("radius_ratio", "", 1.0, 100.0,
                                              "described surroundings in spacings"),
      number_field<&FpfhParams::max_neighbours>(
          "max_neighbours", "", 0, 100000,
          "of one point, thinned evenly beyond; 0 = the preset's limit (PCL: no limit)"),
      choice_field<&FpfhParams::engine>("engine", kEngineNames, "fast, or plain loops in double"),
  };
  return kFields;
}

namespace {

constexpr std::size_t kStride = 40;  ///< 33 bins, padded for the weighted sum

/// Scales each third of the row to a sum of 100.
void normalise_thirds(std::span<float> row) noexcept {
  for (std::size_t third = 0; third < 3; ++third) {
    const std::span<float> bins = row.subspan(third * FpfhEstimator::kBins, FpfhEstimator::kBins);
    double sum = 0.0;
    for (const float bin : bins) sum += static_cast<double>(bin);
    if (sum == 0.0) continue;
    const auto scale = static_cast<float>(100.0 / sum);
    for (float& bin : bins) bin *= scale;
  }
}

}  // namespace

void FpfhEstimator::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points = std::max(limits.max_points, limits.max_model_points);
  max_neighbours_ = params_.max_neighbours > 0 ? static_cast<std::size_t>(params_.max_neighbours)
                                               : limits.max_neighbours;
  search_.reserve(arena, limits);
  simplified_ = arena.take<float>(points * kStride);
  needed_ = arena.take<std::uint8_t>(points);
  others_ = arena.take<std::int32_t>(max_neighbours_);
  bins_ = arena.take<std::int32_t>(max_neighbours_ + 8);
}

std::span<const float> FpfhEstimator::simplified(std::size_t point_i) const noexcept {
  return simplified_.subspan(point_i * kStride, kDimension);
}

void FpfhEstimator::simplify(const Surface& surface, std::size_t point_i, float radius_m) noexcept {
  const std::span<float> histogram = simplified_.subspan(point_i * kStride, kStride);
  std::fill(histogram.begin(), histogram.end(), 0.0F);
  if (!surface.has_normal(point_i)) return;
  const Neighbourhood around = search_.thin(search_.within(point_i, radius_m), max_neighbours_);
  std::size_t count = 0;
  for (const std::int32_t index : around.index) {
    const auto other = static_cast<std::size_t>(index);
    if (other != point_i && surface.has_normal(other)) others_[count++] = index;
  }
  if (count == 0) return;
  // The increment counts all pairs, also those that turn out to have no features.
  const float increment = 100.0F / static_cast<float>(count);
  if (params_.engine == Engine::Fast) {
    const kernels::OrientedPlanes points{surface.x.data(),  surface.y.data(),  surface.z.data(),
                                         surface.nx.data(), surface.ny.data(), surface.nz.data()};
    kernels::pair_bins(points, static_cast<std::int32_t>(point_i), others_.first(count),
                       bins_.data());
    for (std::size_t i = 0; i < count; ++i) {
      if (bins_[i] == kernels::kNoPair) continue;
      const auto packed = static_cast<std::uint32_t>(bins_[i]);
      histogram[packed & 0xff] += increment;
      histogram[kBins + ((packed >> 8) & 0xff)] += increment;
      histogram[2 * kBins + (packed >> 16)] += increment;
    }
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const auto other = static_cast<std::size_t>(others_[i]);
    const PairFeature pair =
        pair_feature(surface.point(point_i).cast<double>(), surface.normal(point_i).cast<double>(),
                     surface.point(other).cast<double>(), surface.normal(other).cast<double>());
    if (!pair.valid) continue;
    histogram[bin_of(pair.f1_rad, -math::kPi, math::kPi, kBins)] += increment;
    histogram[kBins + bin_of(pair.f2, -1.0, 1.0, kBins)] += increment;
    histogram[2 * kBins + bin_of(pair.f3, -1.0, 1.0, kBins)] += increment;
  }
}

void FpfhEstimator::weigh(std::size_t point_i, float radius_m, std::span<float> row) noexcept {
  const Neighbourhood around = search_.thin(search_.within(point_i, radius_m), max_neighbours_);
  std::array<float, kStride> sum{};
  for (std::size_t i = 0; i < around.size(); ++i) {
    if (around.squared_m2[i] == 0.0F) continue;
    const float weight = 1.0F / around.squared_m2[i];
    const float* histogram =
        simplified_.data() + static_cast<std::size_t>(around.index[i]) * kStride;
    for (std::size_t bin = 0; bin < kStride; ++bin) sum[bin] += weight * histogram[bin];
  }
  std::copy_n(sum.begin(), kDimension, row.begin());
  normalise_thirds(row);
}

Status FpfhEstimator::describe(const Surface& surface, std::span<const Keypoint> keypoints,
                               FeatureMatrix& features) noexcept {
  const Result<float> radius_m = begin_description(
      surface, keypoints, params_.radius_m, params_.radius_ratio, kDimension, features, search_);
  if (!radius_m.ok()) return radius_m.error();
  const float radius = radius_m.value();
  std::fill_n(needed_.begin(), surface.size, std::uint8_t{0});
  for (const Keypoint& keypoint : keypoints) {
    const Neighbourhood around = search_.thin(
        search_.within(static_cast<std::size_t>(keypoint.point), radius), max_neighbours_);
    for (const std::int32_t index : around.index) needed_[static_cast<std::size_t>(index)] = 1;
  }
  for (std::size_t i = 0; i < surface.size; ++i) {
    if (needed_[i] != 0) simplify(surface, i, radius);
  }
  for (std::size_t k = 0; k < keypoints.size(); ++k) {
    const auto point_i = static_cast<std::size_t>(keypoints[k].point);
    if (surface.has_normal(point_i)) weigh(point_i, radius, features.row(k));
  }
  return {};
}

}  // namespace grapnel
