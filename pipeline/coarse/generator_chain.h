#pragma once

#include <memory>
#include <vector>

#include "pipeline/stage.h"

namespace grapnel {

/// Several generators beside each other: all of their hypotheses in one list, each supported by the
/// view's score, whatever its generator thinks of it.
class GeneratorChain final : public HypothesisGenerator {
 public:
  /// Of one generator without a score at most `kept` hypotheses are rated.
  GeneratorChain(std::vector<std::unique_ptr<HypothesisGenerator>> generators, std::size_t kept);

  void reserve(Arena& arena, const Limits& limits) override;
  [[nodiscard]] bool supports_by_score() const noexcept override { return true; }
  [[nodiscard]] bool needs_correspondences() const noexcept override;
  /// Fine when one of them is; else the error of the last. BadParameter where there is no score.
  Status generate(const PairView& pair, const Correspondences& correspondences, Rng& rng,
                  Hypotheses& hypotheses) noexcept override;

 private:
  std::vector<std::unique_ptr<HypothesisGenerator>> generators_;
  std::size_t kept_;
  bool some_without_score_ = false;
  Hypotheses unrated_;
};

}  // namespace grapnel
