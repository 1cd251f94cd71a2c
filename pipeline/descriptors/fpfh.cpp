#include "pipeline/descriptors/fpfh.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/math.h"
#include "pipeline/descriptors/common.h"
#include "pipeline/descriptors/pair_feature.h"
#include "pipeline/kernels/weighted_rows.h"

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

static_assert(kernels::kWeightedLength == 40);

/// Points near a block for each that is near one of its points, at the most; where there are more,
/// its points are looked at one by one.
constexpr std::size_t kNearABlock = 4;
/// So many points then, as what is too dense mostly goes on.
constexpr std::size_t kAloneAtLeast = 256;

/// Scales each third of the row to a sum of 100.
template <class Real>
void normalise_thirds(std::span<const Real> sums, std::span<float> row) noexcept {
  for (std::size_t third = 0; third < 3; ++third) {
    const std::size_t first = third * FpfhEstimator::kBins;
    double sum = 0.0;
    for (std::size_t i = 0; i < FpfhEstimator::kBins; ++i) {
      sum += static_cast<double>(sums[first + i]);
    }
    const auto scale = static_cast<Real>(sum == 0.0 ? 0.0 : 100.0 / sum);
    for (std::size_t i = 0; i < FpfhEstimator::kBins; ++i) {
      row[first + i] = static_cast<float>(sums[first + i] * scale);
    }
  }
}

/// In two pieces of known length, which are a few vectors each.
void swap_rows(std::span<float> a, std::span<float> b) noexcept {
  std::array<float, FpfhEstimator::kDimension> from_a;
  std::array<float, FpfhEstimator::kDimension> from_b;
  std::copy_n(a.begin(), from_a.size(), from_a.begin());
  std::copy_n(b.begin(), from_b.size(), from_b.begin());
  std::ranges::copy(from_b, a.begin());
  std::ranges::copy(from_a, b.begin());
}

}  // namespace

void FpfhEstimator::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points = std::max(limits.max_points, limits.max_model_points);
  max_neighbours_ = params_.max_neighbours > 0 ? static_cast<std::size_t>(params_.max_neighbours)
                                               : limits.max_neighbours;
  search_.reserve(arena, limits);
  points_ = arena.take<float>(points * kernels::kOrientedRow);
  weights_ = arena.take<float>(points + kernels::kRowSlack);
  rows_ = arena.take<std::int32_t>(points + kernels::kRowSlack);
  for (std::span<std::int32_t>* list : {&keypoint_of_point_, &row_at_, &keypoint_of_, &others_}) {
    *list = arena.take<std::int32_t>(points);
  }
  const std::size_t near = std::min(kNearABlock * max_neighbours_, points);
  bins_ = arena.take<std::int32_t>(std::max(kernels::kBlock * near, max_neighbours_ + 8));
  near_.position = arena.take<std::int32_t>(near);
  near_.squared_m2 = arena.take<float>(kernels::kBlock * near);
  if (params_.engine == Engine::Reference) {
    plain_sums_ = arena.take<double>(std::max(points, limits.max_keypoints) * kDimension);
  }
}

void FpfhEstimator::arrange(const Surface& surface, std::span<const Keypoint> keypoints) noexcept {
  std::fill_n(keypoint_of_point_.begin(), surface.size, -1);
  for (std::size_t k = keypoints.size(); k-- > 0;) {
    const auto point = static_cast<std::size_t>(keypoints[k].point);
    if (surface.has_normal(point)) keypoint_of_point_[point] = static_cast<std::int32_t>(k);
  }
  all_normals_ = true;
  row_count_ = 0;
  for (std::size_t position = 0; position < surface.size; ++position) {
    const std::size_t point = search_.point_at(position);
    const std::array<float, kernels::kOrientedRow> row = {surface.x[point],
                                                          surface.y[point],
                                                          surface.z[point],
                                                          surface.nx[point],
                                                          surface.ny[point],
                                                          surface.nz[point],
                                                          0.0F,
                                                          0.0F};
    std::ranges::copy(row, points_.data() + position * row.size());
    row_at_[position] = keypoint_of_point_[point];
    if (row_at_[position] >= 0) {
      keypoint_of_[row_count_] = row_at_[position];
      row_at_[position] = static_cast<std::int32_t>(row_count_++);
    }
    all_normals_ = all_normals_ && surface.has_normal(point);
  }
}

std::size_t FpfhEstimator::rows_around(const Neighbourhood& around) noexcept {
  return kernels::select_rows(around.index, around.squared_m2.data(), row_at_.data(), rows_.data(),
                              weights_.data());
}

void FpfhEstimator::count_fast(std::size_t position,
                               std::span<const std::int32_t> others) noexcept {
  kernels::pair_bins(points_.data(), static_cast<std::int32_t>(position), others, bins_.data());
  counts_[0].fill(0);
  kernels::count_bins(bins_.data(), others.size(), counts_[0]);
  std::ranges::transform(counts_[0], histogram_.begin(),
                         [](std::uint32_t count) { return static_cast<float>(count); });
}

void FpfhEstimator::count_plain(std::size_t position,
                                std::span<const std::int32_t> others) noexcept {
  const auto vector = [&](std::size_t i, std::size_t first) {
    const float* from = points_.data() + i * kernels::kOrientedRow + first;
    return Vec3d(static_cast<double>(from[0]), static_cast<double>(from[1]),
                 static_cast<double>(from[2]));
  };
  plain_.fill(0.0);
  for (const std::int32_t index : others) {
    const auto other = static_cast<std::size_t>(index);
    const PairFeature pair =
        pair_feature(vector(position, 0), vector(position, 3), vector(other, 0), vector(other, 3));
    if (!pair.valid) continue;
    plain_[bin_of(pair.f1_rad, -math::kPi, math::kPi, kBins)] += 1.0;
    plain_[kBins + bin_of(pair.f2, -1.0, 1.0, kBins)] += 1.0;
    plain_[2 * kBins + bin_of(pair.f3, -1.0, 1.0, kBins)] += 1.0;
  }
}

/// Those that a point makes pairs with, thinned evenly where they are too many; the point itself,
/// which makes none, may be among them.
std::span<const std::int32_t> FpfhEstimator::partners_of(
    std::span<const std::int32_t> around) noexcept {
  if (all_normals_ && around.size() <= max_neighbours_) return around;
  const std::size_t kept = std::min(around.size(), max_neighbours_);
  // i size / kept without a division each: exact while i kept stays below 2^32.
  constexpr unsigned kFraction = 32;
  const std::uint64_t step = (static_cast<std::uint64_t>(around.size()) << kFraction) / kept + 1;
  std::uint64_t from = 0;
  for (std::size_t i = 0; i < kept; ++i, from += step) others_[i] = around[from >> kFraction];
  const std::span<std::int32_t> thinned = others_.first(kept);
  if (all_normals_) return thinned;
  const auto end = std::remove_if(thinned.begin(), thinned.end(), [&](std::int32_t other) {
    return !has_normal(static_cast<std::size_t>(other));
  });
  return thinned.first(static_cast<std::size_t>(end - thinned.begin()));
}

bool FpfhEstimator::simplify(std::size_t position, const Neighbourhood& around) noexcept {
  if (!has_normal(position)) return false;
  const std::span<const std::int32_t> others = partners_of(around.index);
  const auto itself = std::count(others.begin(), others.end(), static_cast<std::int32_t>(position));
  const std::size_t pairs = others.size() - static_cast<std::size_t>(itself);
  if (pairs == 0) return false;
  // All pairs count, also those that turn out to have no features.
  if (params_.engine == Engine::Fast) {
    count_fast(position, others);
    const float increment = 100.0F / static_cast<float>(pairs);
    for (float& bin : histogram_) bin *= increment;
  } else {
    count_plain(position, others);
    for (double& bin : plain_) bin *= 100.0 / static_cast<double>(pairs);
  }
  return true;
}

void FpfhEstimator::add_to_rows(std::size_t count, FeatureMatrix& features) noexcept {
  if (params_.engine == Engine::Fast) {
    kernels::add_weighted_row(histogram_.data(), rows_.first(count), weights_.data(),
                              features.stride, features.values.data());
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    double* sums = plain_sums_.data() + static_cast<std::size_t>(rows_[i]) * kDimension;
    for (std::size_t bin = 0; bin < kDimension; ++bin) {
      sums[bin] += static_cast<double>(weights_[i]) * plain_[bin];
    }
  }
}

void FpfhEstimator::move_rows(FeatureMatrix& features) noexcept {
  constexpr std::int32_t kEmpty = -1;
  for (std::size_t row = 0; row < row_count_; ++row) {
    // Each round brings one row to its keypoint, and what was there here.
    while (keypoint_of_[row] != kEmpty && keypoint_of_[row] != static_cast<std::int32_t>(row)) {
      const auto to = static_cast<std::size_t>(keypoint_of_[row]);
      swap_rows(features.row(row), features.row(to));
      keypoint_of_[row] = to < row_count_ ? keypoint_of_[to] : kEmpty;
      if (to < row_count_) keypoint_of_[to] = static_cast<std::int32_t>(to);
    }
  }
}

void FpfhEstimator::finish_rows(std::span<const Keypoint> keypoints,
                                FeatureMatrix& features) noexcept {
  if (params_.engine == Engine::Fast) {
    for (std::size_t row = 0; row < row_count_; ++row) {
      normalise_thirds<float>(features.row(row), features.row(row));
    }
    move_rows(features);
  } else {
    for (std::size_t row = 0; row < row_count_; ++row) {
      normalise_thirds<double>(plain_sums_.subspan(row * kDimension, kDimension),
                               features.row(static_cast<std::size_t>(keypoint_of_[row])));
    }
  }
  for (std::size_t k = 0; k < keypoints.size(); ++k) {
    const std::int32_t owner = keypoint_of_point_[static_cast<std::size_t>(keypoints[k].point)];
    // The same point once more.
    if (owner >= 0 && static_cast<std::size_t>(owner) != k) {
      std::ranges::copy(features.row(static_cast<std::size_t>(owner)), features.row(k).begin());
    }
  }
}

bool FpfhEstimator::add_block(const kernels::BlockOfPoints& block,
                              FeatureMatrix& features) noexcept {
  if (!search_.near_block(block, radius_m_, near_)) return false;
  const auto most = static_cast<std::size_t>(*std::ranges::max_element(near_.of));
  if (most > max_neighbours_) return false;
  const std::span<const std::int32_t> positions = near_.position.first(near_.size);
  const bool any = std::ranges::any_of(positions, [&](std::int32_t position) {
    return row_at_[static_cast<std::size_t>(position)] >= 0;
  });
  if (!any) return true;
  kernels::count_block_pairs(points_.data(), block, near_, bins_, counts_);
  for (std::size_t lane = 0; lane < counts_.size(); ++lane) {
    const std::int32_t pairs = near_.of[lane] - 1;
    const float increment = pairs > 0 ? 100.0F / static_cast<float>(pairs) : 0.0F;
    for (std::size_t bin = 0; bin < kDimension; ++bin) {
      block_rows_[lane][bin] = static_cast<float>(counts_[lane][bin]) * increment;
    }
  }
  kernels::add_block_rows(block_rows_, near_, row_at_.data(), features.stride,
                          features.values.data());
  return true;
}

void FpfhEstimator::add_point(std::size_t position, FeatureMatrix& features) noexcept {
  const Neighbourhood around = search_.near_position(position, radius_m_);
  const std::size_t count = rows_around(around);
  if (count > 0 && simplify(position, around)) add_to_rows(count, features);
}

Status FpfhEstimator::describe(const Surface& surface, std::span<const Keypoint> keypoints,
                               FeatureMatrix& features) noexcept {
  const Result<float> radius_m = begin_description(
      surface, keypoints, params_.radius_m, params_.radius_ratio, kDimension, features, search_);
  if (!radius_m.ok()) return radius_m.error();
  radius_m_ = radius_m.value();
  if (params_.engine == Engine::Reference) {
    if (keypoints.size() * kDimension > plain_sums_.size()) {
      return Error{Code::CapacityExceeded, Stage::Descriptors,
                   static_cast<std::int32_t>(keypoints.size())};
    }
    std::fill_n(plain_sums_.begin(), keypoints.size() * kDimension, 0.0);
  }
  arrange(surface, keypoints);
  const bool by_blocks = params_.engine == Engine::Fast && all_normals_;
  std::size_t alone = 0;  // up to where points are looked at one by one
  for (std::size_t position = 0; position < surface.size;) {
    if (!by_blocks || position < alone) {
      add_point(position++, features);
      continue;
    }
    const kernels::BlockOfPoints block = search_.block_from(position, radius_m_);
    if (add_block(block, features)) {
      position += static_cast<std::size_t>(block.count);
    } else {
      alone = position + kAloneAtLeast;
    }
  }
  finish_rows(keypoints, features);
  return {};
}

std::span<const float> FpfhEstimator::simplified(const Surface& surface,
                                                 std::size_t point_i) noexcept {
  histogram_.fill(0.0F);
  for (std::size_t position = 0; position < surface.size; ++position) {
    if (search_.point_at(position) != point_i) continue;
    if (!simplify(position, search_.near_position(position, radius_m_))) continue;
    if (params_.engine == Engine::Reference) {
      for (std::size_t bin = 0; bin < kDimension; ++bin) {
        histogram_[bin] = static_cast<float>(plain_[bin]);
      }
    }
  }
  return std::span<const float>(histogram_).first(kDimension);
}

}  // namespace grapnel
