#include "pipeline/correspond/nearest_feature.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace grapnel {
namespace {

constexpr std::size_t kLanes = 8;

bool all_zero(std::span<const float> row) noexcept {
  return std::all_of(row.begin(), row.end(), [](float value) { return value == 0.0F; });
}

/// Eight partial sums folded by a fixed tree: the same bits however wide the machine is.
float square_distance(const float* a, const float* b, std::size_t padded) noexcept {
  std::array<float, kLanes> sum{};
  for (std::size_t i = 0; i < padded; i += kLanes) {
    for (std::size_t k = 0; k < kLanes; ++k) {
      const float difference = a[i + k] - b[i + k];
      sum[k] += difference * difference;
    }
  }
  return ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
}

}  // namespace

FieldTable nearest_feature_fields() noexcept {
  using P = NearestFeatureParams;
  static constexpr std::array kFields = {
      number_field<&P::top>("top", "", 1, NearestFeature::kMaxTop,
                            "targets kept for each source keypoint"),
      bool_field<&P::mutual>("mutual", "keep only pairs that choose each other"),
      number_field<&P::max_ratio>("max_ratio", "", 0.1, 1.0,
                                  "nearest over second nearest distance, at most"),
      number_field<&P::max_distance>("max_distance", "", 0.0, 1e6,
                                     "distance of a pair at the most; 0 = any"),
  };
  return kFields;
}

void NearestFeature::reserve(Arena& arena, const Limits& limits) {
  best_ = arena.take<Best>(limits.max_keypoints * (kMaxTop + 1));
  best_of_target_ = arena.take<Best>(limits.max_keypoints);
}

void NearestFeature::search(const FeatureMatrix& source, const FeatureMatrix& target) noexcept {
  constexpr float kFar = std::numeric_limits<float>::max();
  const std::size_t kept = std::max<std::size_t>(params_.top, 1) + 1;
  std::fill_n(best_.begin(), source.rows * kept, Best{kFar, -1});
  std::fill_n(best_of_target_.begin(), target.rows, Best{kFar, -1});
  for (std::size_t s = 0; s < source.rows; ++s) {
    if (all_zero(source.row(s))) continue;
    const float* a = source.values.data() + s * source.stride;
    Best* best = best_.data() + s * kept;
    for (std::size_t t = 0; t < target.rows; ++t) {
      const float square =
          square_distance(a, target.values.data() + t * target.stride, source.stride);
      Best& reverse = best_of_target_[t];
      if (square < reverse.square) reverse = {square, static_cast<std::int32_t>(s)};
      if (!(square < best[kept - 1].square)) continue;
      std::size_t place = kept - 1;
      while (place > 0 && square < best[place - 1].square) {
        best[place] = best[place - 1];
        --place;
      }
      best[place] = {square, static_cast<std::int32_t>(t)};
    }
  }
}

Status NearestFeature::match(const FeatureMatrix& source, const FeatureMatrix& target,
                             Correspondences& correspondences) noexcept {
  correspondences.clear();
  if (source.stride != target.stride) {
    return Error{Code::BadParameter, Stage::Match, static_cast<std::int32_t>(target.stride)};
  }
  search(source, target);
  const std::size_t kept = std::max<std::size_t>(params_.top, 1) + 1;
  for (std::size_t s = 0; s < source.rows; ++s) {
    const Best* best = best_.data() + s * kept;
    if (best[0].row < 0) continue;
    const float ratio = static_cast<float>(params_.max_ratio);
    if (best[1].row >= 0 && ratio < 1.0F && best[0].square > ratio * ratio * best[1].square) {
      continue;
    }
    for (std::size_t k = 0; k + 1 < kept && best[k].row >= 0; ++k) {
      const auto t = static_cast<std::size_t>(best[k].row);
      if (all_zero(target.row(t))) continue;
      if (params_.mutual && best_of_target_[t].row != static_cast<std::int32_t>(s)) continue;
      const float distance = std::sqrt(best[k].square);
      if (params_.max_distance > 0.0 && static_cast<double>(distance) > params_.max_distance) {
        break;
      }
      correspondences.push_back({static_cast<std::int32_t>(s), best[k].row, distance});
    }
  }
  return {};
}

}  // namespace grapnel
