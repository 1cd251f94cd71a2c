#include "workbench/depth_filter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/input_error.h"
#include "pipeline/preprocess/depth_outliers.h"
#include "pipeline/preprocess/median.h"
#include "workbench/stage_run.h"
#include "workbench/surfaces.h"

namespace grapnel {
namespace {

constexpr std::size_t kMaxCount = 65535;

/// The cloud's depths as counts, and back. A median only compares, so the counts are ranks of the
/// depths that occur: nothing is rounded. Where there are more depths than counts, or where
/// distances matter, they are even steps.
class Counts {
 public:
  Counts(const CloudData& cloud, bool by_rank) {
    for (const float z : cloud.z) {
      if (std::isfinite(z) && z > 0.0F) depths_.push_back(z);
    }
    std::sort(depths_.begin(), depths_.end());
    depths_.erase(std::unique(depths_.begin(), depths_.end()), depths_.end());
    by_rank_ = by_rank && depths_.size() <= kMaxCount;
    const double farthest = depths_.empty() ? 1.0 : static_cast<double>(depths_.back());
    metres_per_unit_ = farthest / static_cast<double>(kMaxCount);
  }

  [[nodiscard]] double metres_per_unit() const noexcept { return metres_per_unit_; }
  [[nodiscard]] std::uint16_t count(float z) const {
    if (!(std::isfinite(z) && z > 0.0F)) return 0;
    if (!by_rank_) {
      const double steps = std::round(static_cast<double>(z) / metres_per_unit_);
      return static_cast<std::uint16_t>(std::clamp(steps, 1.0, static_cast<double>(kMaxCount)));
    }
    const auto place = std::lower_bound(depths_.begin(), depths_.end(), z);
    return static_cast<std::uint16_t>(place - depths_.begin() + 1);
  }
  [[nodiscard]] float depth_m(std::uint16_t count) const {
    return by_rank_ ? depths_[count - 1U] : static_cast<float>(count * metres_per_unit_);
  }

 private:
  std::vector<float> depths_;
  bool by_rank_ = false;
  double metres_per_unit_ = 0.0;
};

template <class Params>
Params take_params(FieldTable fields, const std::vector<std::string>& overrides) {
  ConfigTable table("command line", "", 0);
  for (const std::string& assignment : overrides) apply_override(table, assignment);
  ConfigReader reader(table);
  Params params;
  reader.take_fields(fields, &params);
  reader.finish();
  return params;
}

template <class Filter>
void run(Filter filter, WorkingDepth& work, const Limits& limits) {
  const Block block = carve([&](Arena& arena) { filter.reserve(arena, limits); });
  filter.apply(work);
}

void set_depth(CloudData& cloud, std::size_t i, float z) {
  const float scale = z / cloud.z[i];
  cloud.x[i] *= scale;
  cloud.y[i] *= scale;
  cloud.z[i] = z;
}

}  // namespace

bool is_depth_filter(const std::string& method) noexcept {
  return method == "median" || method == "flying_pixels";
}

std::size_t filter_depth(CloudData& cloud, const std::string& method,
                         const std::vector<std::string>& overrides) {
  const Intrinsics intrinsics = fit_intrinsics(cloud);
  if (!intrinsics.valid()) {
    throw InputError("--method " + method + ": the cloud is not organised as a camera's grid");
  }
  const bool median = method == "median";
  const Counts counts(cloud, median);
  Limits limits;
  limits.max_width = cloud.width;
  limits.max_height = cloud.height;
  WorkingDepth work;
  const Block block = carve([&](Arena& arena) { work.reserve(arena, limits); });
  work.depth = {work.depth_memory.data(), cloud.width, cloud.height};
  work.label = {work.label_memory.data(), cloud.width, cloud.height};
  work.intrinsics = intrinsics;
  work.metres_per_unit = counts.metres_per_unit();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    work.depth_memory[i] = counts.count(cloud.z[i]);
    work.label_memory[i] = work.depth_memory[i] != 0 ? kForeground : kNoLabel;
  }
  if (median) {
    const auto params = take_params<DepthMedianParams>(depth_median_fields(), overrides);
    run(DepthMedian(params), work, limits);
  } else {
    const auto params = take_params<DepthOutlierParams>(depth_outlier_fields(), overrides);
    run(DepthOutliers(params), work, limits);
  }
  std::size_t removed = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!(std::isfinite(cloud.z[i]) && cloud.z[i] > 0.0F)) continue;
    if (work.depth_memory[i] == 0) {
      cloud.x[i] = cloud.y[i] = cloud.z[i] = std::numeric_limits<float>::quiet_NaN();
      ++removed;
    } else if (median || work.depth_memory[i] != counts.count(cloud.z[i])) {
      set_depth(cloud, i, counts.depth_m(work.depth_memory[i]));
    }
  }
  return removed;
}

}  // namespace grapnel
