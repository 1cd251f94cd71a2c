#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/reject/ends.h"
#include "pipeline/stage.h"

namespace grapnel {

/// Which pairs of the graph are kept.
enum class GraphKeep : std::uint8_t {
  Cliques,  ///< the largest groups of pairs that all agree with each other
  Core,     ///< the core of the highest degree (Lim 2024, KISS-Matcher; Shi 2021, ROBIN)
};

struct GraphRejectorParams {
  GraphKeep keep = GraphKeep::Cliques;
  double tolerance_m = 0.0;       ///< 0 = auto: 1.5 × the target's spacing
  double normal_tolerance = 0.4;  ///< of the cosines between normals; 2 = any
  std::size_t max_pairs = 1024;   ///< the nearest by descriptor take part, the others are dropped
  std::size_t seeds = 64;         ///< pairs that cliques are grown from
  std::size_t cliques = 4;        ///< distinct ones kept: symmetric parts have several
};
[[nodiscard]] FieldTable graph_rejector_fields() noexcept;

/// Keeps pairs that are consistent with each other: two pairs agree when the length between their
/// sources is that between their targets (Leordeanu 2005; Yang 2020, TEASER, section 5) and the
/// angle between their normals is too. Cliques are grown greedily from the pairs with most
/// second-order support, the number of pairs that agree with both (Chen 2022, SC²-PCR, eq. 4).
/// Errors: TooFewCorrespondences, NoConsensus. O(pairs² + seeds × clique × pairs² / 64).
class GraphRejector final : public CorrespondenceRejector {
 public:
  explicit GraphRejector(const GraphRejectorParams& params) : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  Status reject(const PairView& pair, Correspondences& correspondences, Rng& rng) noexcept override;

  /// Pairs of each clique that the last run kept, in no order.
  [[nodiscard]] std::span<const std::size_t> clique_sizes() const noexcept {
    return sizes_.first(found_);
  }

 private:
  /// Leaves the nearest max_pairs, in their order.
  void shorten(Correspondences& correspondences) noexcept;
  void connect(const PairView& pair, const Correspondences& correspondences,
               double tolerance_m) noexcept;
  void drop_odd_normals(const PairView& pair, const Correspondences& correspondences) noexcept;
  /// Core number of every pair (Batagelj and Zaversnik 2003); returns the largest.
  std::size_t find_cores() noexcept;
  void prune(std::size_t highest) noexcept;
  void score_seeds() noexcept;
  /// Grows `clique` from one pair. Returns its size.
  std::size_t grow(std::size_t seed, std::span<std::uint64_t> clique) noexcept;
  void keep_clique(std::span<const std::uint64_t> clique, std::size_t size) noexcept;
  void find_cliques() noexcept;
  /// Mark what is kept; return how many pairs agree with each other at the most.
  std::size_t mark_core() noexcept;
  std::size_t mark_cliques() noexcept;

  [[nodiscard]] std::span<std::uint64_t> row(std::size_t i) const noexcept {
    return adjacency_.subspan(i * words_, words_);
  }

  GraphRejectorParams params_;
  PairEnds ends_;
  std::size_t count_ = 0;
  std::size_t words_ = 0;  ///< of a row of the current graph
  std::size_t found_ = 0;
  std::span<std::uint64_t> adjacency_;  ///< row of bits a pair
  std::span<std::uint64_t> cliques_;    ///< kept ones, a row of bits each
  std::span<std::uint64_t> candidates_, grown_, kept_;
  std::span<std::size_t> sizes_;
  std::span<std::int32_t> order_, core_, position_, bucket_;
  std::span<std::uint32_t> support_;
  std::span<float> normals_;
};

}  // namespace grapnel
