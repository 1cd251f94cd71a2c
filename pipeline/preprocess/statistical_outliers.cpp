#include "pipeline/preprocess/statistical_outliers.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/preprocess/compact.h"

namespace grapnel {
namespace {

constexpr std::array<std::string_view, 2> kEngines = {"fast", "reference"};
constexpr int kNearReach = 3;

std::size_t others_in(int reach) noexcept {
  return static_cast<std::size_t>((2 * reach + 1) * (2 * reach + 1) - 1);
}

}  // namespace

FieldTable statistical_outlier_fields() noexcept {
  using P = StatisticalOutlierParams;
  static constexpr std::array kFields = {
      number_field<&P::k>("k", "", 1, 1000, "nearest other points whose mean distance counts"),
      number_field<&P::std_mul>("std_mul", "", -10.0, 100.0,
                                "standard deviations above the cloud's mean that are kept"),
      choice_field<&P::engine>("engine", kEngines, "reference: every point by a search, in double"),
  };
  return kFields;
}

StatisticalOutliers::StatisticalOutliers(const StatisticalOutlierParams& params)
    : params_(params),
      near_(kNearReach, std::min(static_cast<std::size_t>(params.k), others_in(kNearReach))),
      wide_(kernels::kMaxWindowReach,
            std::min(static_cast<std::size_t>(params.k), kernels::kMaxWindowPoints)) {}

void StatisticalOutliers::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points =
      std::max({limits.max_input_points, limits.max_points, limits.max_model_points});
  grid_.reserve(arena, limits.max_width, limits.max_height);
  search_.reserve(
      arena, points,
      static_cast<std::size_t>(limits.max_width) * static_cast<std::size_t>(limits.max_height));
  memory_ = arena.take<float>(points);
  keep_ = arena.take<std::uint8_t>(points);
}

float StatisticalOutliers::measure(const Surface& surface, std::size_t point_i) noexcept {
  const auto k = static_cast<std::size_t>(params_.k);
  // The point itself is among them, at no distance.
  const Neighbourhood nearest = search_.nearest(surface.point(point_i), k + 1);
  double sum = 0.0;
  for (const float square : nearest.squared_m2) sum += std::sqrt(static_cast<double>(square));
  return static_cast<float>(sum / static_cast<double>(params_.k));
}

void StatisticalOutliers::measure_eight(const Surface& surface, int u, int v) noexcept {
  alignas(64) std::array<float, kernels::kLanes> sum_m{};
  alignas(64) std::array<float, kernels::kLanes> farthest_m2{};
  const int width = surface.grid.width;
  const int end = std::min(width, u + static_cast<int>(kernels::kLanes));
  unsigned open = 0;  // points whose nearest are not proven yet
  const std::int32_t* points =
      surface.grid.point_of.data() + static_cast<std::ptrdiff_t>(v) * width;
  for (int i = u; i < end; ++i) open |= points[i] >= 0 ? 1U << (i - u) : 0U;
  for (const kernels::WindowSelection* window : {&near_, &wide_}) {
    if (open == 0 || window->nearest() < static_cast<std::size_t>(params_.k)) continue;
    kernels::nearest_in_window(grid_.planes(), grid_.at(u, v), *window, sum_m.data(),
                               farthest_m2.data());
    for (int i = u; i < end; ++i) {
      if ((open >> (i - u) & 1U) == 0) continue;
      const auto point = static_cast<std::size_t>(points[i]);
      const auto lane = static_cast<std::size_t>(i - u);
      const float outside_m2 = grid_.least_outside_m2(i, v, surface.z[point], window->reach());
      if (!(farthest_m2[lane] <= outside_m2)) continue;
      mean_m_[point] = sum_m[lane] / static_cast<float>(params_.k);
      open &= ~(1U << (i - u));
    }
  }
  for (int i = u; i < end; ++i) {
    if ((open >> (i - u) & 1U) == 0) continue;
    const auto point = static_cast<std::size_t>(points[i]);
    mean_m_[point] = measure(surface, point);
  }
}

void StatisticalOutliers::measure_grid(const Surface& surface) noexcept {
  for (int v = 0; v < surface.grid.height; ++v) {
    for (int u = 0; u < surface.grid.width; u += static_cast<int>(kernels::kLanes)) {
      measure_eight(surface, u, v);
    }
  }
}

Result<std::size_t> StatisticalOutliers::apply(Surface& surface) noexcept {
  if (const Status status = check_points(surface, keep_.size(), Stage::Outliers); !status.ok()) {
    return status.error();
  }
  if (surface.size <= static_cast<std::size_t>(params_.k)) {
    return Error{Code::TooFewPoints, Stage::Outliers, static_cast<std::int32_t>(surface.size)};
  }
  mean_m_ = memory_.first(surface.size);
  const double typical_m = surface.spacing_m > 0.0
                               ? surface.spacing_m * std::sqrt(static_cast<double>(params_.k))
                               : 1e-3;
  if (const Status status = search_.build(surface, typical_m); !status.ok()) {
    return Error{status.error().code, Stage::Outliers, status.error().detail};
  }
  if (params_.engine == Engine::Fast && grid_.build(surface)) {
    measure_grid(surface);
  } else {
    for (std::size_t i = 0; i < surface.size; ++i) mean_m_[i] = measure(surface, i);
  }
  const auto count = static_cast<double>(surface.size);
  double sum = 0.0;
  double squares = 0.0;
  for (const float mean : mean_m_) {
    sum += static_cast<double>(mean);
    squares += static_cast<double>(mean) * static_cast<double>(mean);
  }
  const double variance = (squares - sum * sum / count) / (count - 1.0);
  const double limit = sum / count + params_.std_mul * std::sqrt(std::max(0.0, variance));
  for (std::size_t i = 0; i < surface.size; ++i) {
    keep_[i] = static_cast<double>(mean_m_[i]) <= limit ? 1 : 0;
  }
  return keep_points(surface, keep_);
}

}  // namespace grapnel
