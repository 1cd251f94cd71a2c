#include "pipeline/coarse/pose_finalists.h"

#include <cstdint>

#include "pipeline/coarse/hypothesis_list.h"
#include "pipeline/coarse/pose_score.h"

namespace grapnel {
namespace {

// Poses this near are one, in radii of the source: less than coarse refinement bridges.
constexpr double kSame = 0.06;

}  // namespace

void PoseFinalists::reserve(Arena& arena) { storage_ = arena.take<Hypothesis>(kKept); }

void PoseFinalists::begin(const PairView& pair, std::size_t quick_samples,
                          std::size_t ratings) noexcept {
  kept_ = Hypotheses(storage_);
  score_ = pair.score;
  quick_samples_ = quick_samples;
  left_ = ratings;
  any_ = false;
  Vec3f low = Vec3f::Constant(1e30F);
  Vec3f high = -low;
  for (std::size_t i = 0; i < pair.source->size; ++i) {
    low = low.cwiseMin(pair.source->point(i));
    high = high.cwiseMax(pair.source->point(i));
  }
  centre_ = (0.5F * (low + high)).cast<double>();
  radius_m_ = 0.5 * static_cast<double>((high - low).norm());
}

bool PoseFinalists::offer(const Pose& target_from_source) noexcept {
  if (left_ == 0) return false;
  --left_;
  if (!target_from_source.matrix().allFinite()) return true;
  any_ = true;
  const double weakest = kept_.full() ? kept_[kept_.size() - 1].support : -1e9;
  const double support = score_->glance(target_from_source, quick_samples_, weakest);
  if (!(support > weakest)) return true;
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    if (displacement_m(kept_[i].target_from_source, target_from_source, centre_, radius_m_) >
        kSame * radius_m_) {
      continue;
    }
    if (support <= kept_[i].support) return true;
    for (std::size_t k = i + 1; k < kept_.size(); ++k) kept_[k - 1] = kept_[k];
    kept_.resize(kept_.size() - 1);
    break;
  }
  keep_best(kept_, {target_from_source, support});
  return true;
}

Status PoseFinalists::conclude(Hypotheses& hypotheses) noexcept {
  for (Hypothesis& hypothesis : kept_) {
    hypothesis.support = (*score_)(hypothesis.target_from_source, SIZE_MAX);
    keep_best(hypotheses, hypothesis);
  }
  if (!any_) return Error{Code::NoConsensus, Stage::Coarse, 0};
  return {};
}

}  // namespace grapnel
