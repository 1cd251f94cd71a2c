#include "pipeline/coarse/generator_chain.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "pipeline/coarse/hypothesis_list.h"
#include "pipeline/coarse/pose_score.h"

namespace grapnel {

GeneratorChain::GeneratorChain(std::vector<std::unique_ptr<HypothesisGenerator>> generators,
                               std::size_t kept)
    : generators_(std::move(generators)), kept_(kept) {
  for (const auto& generator : generators_) {
    some_without_score_ = some_without_score_ || !generator->supports_by_score();
  }
}

void GeneratorChain::reserve(Arena& arena, const Limits& limits) {
  for (const auto& generator : generators_) generator->reserve(arena, limits);
  if (some_without_score_) unrated_ = Hypotheses(arena.take<Hypothesis>(kept_));
}

bool GeneratorChain::needs_correspondences() const noexcept {
  return std::any_of(generators_.begin(), generators_.end(),
                     [](const auto& generator) { return generator->needs_correspondences(); });
}

Status GeneratorChain::generate(const PairView& pair, const Correspondences& correspondences,
                                Rng& rng, Hypotheses& hypotheses) noexcept {
  if (pair.score == nullptr) return Error{Code::BadParameter, Stage::Coarse, 0};
  Status last = Error{Code::NoConsensus, Stage::Coarse, 0};
  bool any = false;
  for (const auto& generator : generators_) {
    const bool by_score = generator->supports_by_score();
    unrated_.clear();
    last = generator->generate(pair, correspondences, rng, by_score ? hypotheses : unrated_);
    any = any || last.ok();
    for (Hypothesis& hypothesis : unrated_) {
      hypothesis.support = (*pair.score)(hypothesis.target_from_source, SIZE_MAX);
      keep_best(hypotheses, hypothesis);
    }
  }
  return any ? Status{} : last;
}

}  // namespace grapnel
