#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/coarse/pose_finalists.h"
#include "pipeline/stage.h"

namespace grapnel {

struct PairVotingParams {
  std::size_t model_points = 300;  ///< of the source, spread evenly, whose pairs are learned
  std::size_t references = 60;     ///< points of the target that vote
  std::size_t partners = 500;      ///< points of the target that each is paired with
  std::size_t max_bucket = 64;     ///< pairs kept of those with the same features
  std::size_t peaks = 2;           ///< poses proposed by a reference point
  std::size_t quick_samples = 48;  ///< of a first rating
};
[[nodiscard]] FieldTable pair_voting_fields() noexcept;

/// Voting by point pair features (Drost, Ulrich, Navab and Ilic 2010): distance and three angles of
/// two oriented points, of all pairs of the source in a table; each pair of a reference point votes
/// for where that point lies on the source and how it is turned about its normal. A flat face puts
/// thousands of pairs into a few buckets: these keep an even choice, and a vote counts the less the
/// more pairs share its features. Needs the view's score; correspondences are not looked at. The
/// table of the last source is kept; another one is learned in O(model_points²).
class PairVoting final : public HypothesisGenerator {
 public:
  explicit PairVoting(const PairVotingParams& params);

  void reserve(Arena& arena, const Limits& limits) override;
  [[nodiscard]] bool supports_by_score() const noexcept override { return true; }
  [[nodiscard]] bool needs_correspondences() const noexcept override { return false; }
  Status generate(const PairView& pair, const Correspondences& correspondences, Rng& rng,
                  Hypotheses& hypotheses) noexcept override;

 private:
  static constexpr std::size_t kCosines = 256;
  struct Entry {
    std::uint16_t point = 0;  // of model_
    std::uint16_t turn = 0;   // about its normal, 65536 = a full turn
  };

  void learn(const Surface& source) noexcept;
  /// Row of the table of a pair's features, -1 = a pair too near or too far apart.
  [[nodiscard]] std::int32_t bucket_of(const Surface& surface, std::size_t i,
                                       std::size_t j) const noexcept;
  void vote(const Surface& target, std::size_t reference) noexcept;
  void propose(const PairView& pair, std::size_t reference) noexcept;

  PairVotingParams params_;
  std::array<std::uint8_t, kCosines> angle_bin_{};
  PoseFinalists finalists_;
  std::span<std::uint32_t> model_;   // indices of the source's points
  std::span<std::int32_t> bucket_;   // of every pair, while learning
  std::span<std::uint32_t> begin_;   // first entry of every bucket, one more at the end
  std::span<std::uint32_t> length_;  // pairs with its features, kept or not
  std::span<std::uint32_t> seen_;    // the same, counted while they are filled
  std::span<Entry> entries_;
  std::span<std::uint32_t> votes_;
  std::size_t model_size_ = 0;
  double diameter_m_ = 0.0;
  std::uint64_t learned_ = 0;
};

}  // namespace grapnel
