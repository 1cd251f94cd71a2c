#include "pipeline/descriptors/common.h"

#include <algorithm>
#include <cmath>

namespace grapnel {

Result<float> begin_description(const Surface& surface, std::span<const Keypoint> keypoints,
                                double radius_m, double radius_ratio, std::size_t dimension,
                                FeatureMatrix& features, NeighbourSearch& search) noexcept {
  features.rows = 0;
  if (features.dimension != dimension ||
      keypoints.size() * features.stride > features.values.size()) {
    return Error{Code::CapacityExceeded, Stage::Descriptors,
                 static_cast<std::int32_t>(keypoints.size())};
  }
  const double wanted_m = radius_m > 0.0 ? radius_m : radius_ratio * surface.spacing_m;
  if (!(wanted_m > 0.0)) return Error{Code::BadParameter, Stage::Descriptors, 0};
  if (const Status built = search.build(surface, wanted_m); !built.ok()) {
    return Error{built.error().code, Stage::Descriptors, built.error().detail};
  }
  features.rows = keypoints.size();
  std::fill_n(features.values.begin(), features.rows * features.stride, 0.0F);
  return static_cast<float>(wanted_m);
}

std::size_t bin_of(double value, double low, double high, std::size_t bins) noexcept {
  const auto count = static_cast<double>(bins);
  const double place = std::floor(count * (value - low) / (high - low));
  return static_cast<std::size_t>(std::clamp(place, 0.0, count - 1.0));
}

}  // namespace grapnel
