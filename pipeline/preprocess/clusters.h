#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/stage.h"

namespace grapnel {

struct ClusterParams {
  double distance_m = 0.0;  ///< points nearer than this belong together; 0 = auto: distance_ratio
  double distance_ratio = 3.0;
  int min_points = 1;
  int kept = 1;  ///< clusters, largest first
};
[[nodiscard]] FieldTable cluster_fields() noexcept;

/// Keeps the largest connected components of a cloud: points belong together when a chain of points
/// joins them whose steps are at most a distance (Rusu 2009, section 6.2; as PCL's
/// EuclideanClusterExtraction).
class Clusters final : public CloudFilter {
 public:
  explicit Clusters(const ClusterParams& params) noexcept : params_(params) {}

  /// Room for clouds of the limits' max_input_points.
  void reserve(Arena& arena, const Limits& limits) override;
  /// Errors: TooFewPoints (also: no cluster is large enough), CapacityExceeded, BadParameter (no
  /// distance, not finite).
  Result<std::size_t> apply(Surface& surface) noexcept override;

  /// Clusters of the last surface, whatever their size.
  [[nodiscard]] std::size_t found() const noexcept { return found_; }

 private:
  /// Gives each point the number of its cluster.
  void label(const Surface& surface, float distance_m) noexcept;

  ClusterParams params_;
  NeighbourSearch search_;
  std::span<std::int32_t> label_, stack_, size_of_;
  std::span<std::uint8_t> keep_;
  std::size_t found_ = 0;
};

}  // namespace grapnel
