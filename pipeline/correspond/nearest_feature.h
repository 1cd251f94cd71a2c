#pragma once

#include <cstddef>
#include <span>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct NearestFeatureParams {
  std::size_t top = 1;      ///< targets kept for each source, nearest first
  bool mutual = false;      ///< only pairs that choose each other
  double max_ratio = 1.0;   ///< nearest distance / second nearest; 1 = any
  double max_distance = 0;  ///< 0 = any
};
[[nodiscard]] FieldTable nearest_feature_fields() noexcept;

/// Nearest rows by exhaustive search, Euclidean distance. Rows of zeros match nothing. Pairs come
/// in the order of the source rows. O(source × target × dimension).
class NearestFeature final : public FeatureMatcher {
 public:
  /// The most targets kept for one source.
  static constexpr std::size_t kMaxTop = 8;

  explicit NearestFeature(const NearestFeatureParams& params) : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  Status match(const FeatureMatrix& source, const FeatureMatrix& target,
               Correspondences& correspondences) noexcept override;

 private:
  struct Best {
    float square = 0.0F;
    std::int32_t row = -1;
  };
  void search(const FeatureMatrix& source, const FeatureMatrix& target) noexcept;

  NearestFeatureParams params_;
  std::span<Best> best_;            // rows × (top + 1), nearest first
  std::span<Best> best_of_target_;  // nearest source of each target
};

}  // namespace grapnel
