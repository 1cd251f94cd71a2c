#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/correspond/metric.h"
#include "pipeline/correspond/metric_rows.h"
#include "pipeline/kernels/best_rows.h"
#include "pipeline/stage.h"

namespace grapnel {

/// Whether rows are scaled to a sum of 1 first.
enum class Normalise : std::uint8_t { Auto, No, Yes };

struct NearestFeatureParams {
  Metric metric = Metric::L2;
  std::size_t top = 1;      ///< targets kept for each source, nearest first
  bool mutual = false;      ///< only pairs that choose each other
  double max_ratio = 1.0;   ///< nearest distance / second nearest; 1 = any
  double max_distance = 0;  ///< 0 = any
  /// Auto: for the metrics between distributions. Such rows also get 1e-6 added to every bin, so
  /// that none is empty. PCL: No.
  Normalise normalise = Normalise::Auto;
  double source_factor = 1.0;  ///< of the metrics pf and k (PCL's P1)
  double target_factor = 1.0;  ///< of the metrics pf and k (PCL's P2)
  Engine engine = Engine::Fast;
};
[[nodiscard]] FieldTable nearest_feature_fields() noexcept;

/// Nearest rows by exhaustive search under a metric. Rows of zeros match nothing. Pairs come in the
/// order of the source rows, their distance is the metric's value. The fast engine orders rows in
/// single precision: a pair it takes is within rounding of the nearest.
/// O(source × target × dimension). Errors: BadParameter, CapacityExceeded.
class NearestFeature final : public FeatureMatcher {
 public:
  /// The most targets kept for one source.
  static constexpr std::size_t kMaxTop = 8;

  explicit NearestFeature(const NearestFeatureParams& params)
      : params_(params), plan_(plan_metric(params.metric)) {}

  void reserve(Arena& arena, const Limits& limits) override;
  Status match(const FeatureMatrix& source, const FeatureMatrix& target,
               Correspondences& correspondences) noexcept override;

 private:
  /// Rows of `rows` nearest to each row of `queries`, `kept` each. `queries_are` tells the sides.
  void search(const FeatureMatrix& queries, const FeatureMatrix& rows, MetricSide queries_are,
              std::size_t kept, std::span<kernels::BestRow> best) noexcept;
  void search_fast(const FeatureMatrix& queries, const FeatureMatrix& rows, MetricSide queries_are,
                   std::size_t kept, std::span<kernels::BestRow> best) noexcept;
  void search_plain(const FeatureMatrix& queries, const FeatureMatrix& rows, MetricSide queries_are,
                    std::size_t kept, std::span<kernels::BestRow> best) noexcept;
  /// By how much they differ among the rows, most first, so that sums grow early.
  void order_elements(const FeatureMatrix& rows, std::size_t length) noexcept;
  void fill_blocks(const FeatureMatrix& rows, MetricSide side) noexcept;
  /// A row as the metric reads it.
  std::span<const double> prepare(std::span<const float> row, std::span<double> out) const noexcept;
  double distance(const FeatureMatrix& source, std::size_t s, const FeatureMatrix& target,
                  std::size_t t) noexcept;
  /// Adds the pairs of one source row.
  void keep(const FeatureMatrix& source, std::size_t s, const FeatureMatrix& target,
            Correspondences& correspondences) noexcept;

  NearestFeatureParams params_;
  MetricPlan plan_;
  std::span<kernels::BestRow> best_;            // rows × (top + 1), nearest first
  std::span<kernels::BestRow> best_of_target_;  // nearest source of each target
  std::span<float> queries_;                    // transformed, row after row
  std::span<float> row_;                        // one, before its elements are put in order
  std::span<std::uint32_t> order_;              // element of the row at each place
  std::span<float> blocks_, bias_;
  std::span<double> left_, right_;
};

}  // namespace grapnel
