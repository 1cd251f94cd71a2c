#pragma once

#include <cstddef>
#include <span>

#include "pipeline/correspond/metric.h"
#include "pipeline/kernels/best_rows.h"

namespace grapnel {

/// A metric as a sum of one simple operation over rows transformed once each: what makes every
/// metric as cheap as the Euclidean one. The sums order rows as the metric does; they are not its
/// values.
struct MetricPlan {
  kernels::RowScore score = kernels::RowScore::SquaredDifference;
  std::size_t parts = 1;  ///< transformed length in lengths of the row
  std::size_t extra = 0;  ///< and elements beyond
  [[nodiscard]] std::size_t length(std::size_t dimension) const noexcept {
    return parts * dimension + extra;
  }
};
[[nodiscard]] MetricPlan plan_metric(Metric metric) noexcept;

/// Whose row it is: some metrics transform the two sides differently.
enum class MetricSide : std::uint8_t { Source, Target };

/// Writes the transformed row, plan.length(row.size()) elements.
void transform_row(Metric metric, const MetricFactors& factors, MetricSide side,
                   std::span<const double> row, std::span<float> out) noexcept;

}  // namespace grapnel
