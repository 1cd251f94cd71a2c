#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "pipeline/stage.h"

namespace grapnel {

/// Several rejectors, one after the other, on what the one before left.
class RejectorChain final : public CorrespondenceRejector {
 public:
  explicit RejectorChain(std::vector<std::unique_ptr<CorrespondenceRejector>> links)
      : links_(std::move(links)) {}

  void reserve(Arena& arena, const Limits& limits) override {
    for (const auto& link : links_) link->reserve(arena, limits);
  }
  /// The first link's error, with which it ends.
  Status reject(const PairView& pair, Correspondences& correspondences,
                Rng& rng) noexcept override {
    for (const auto& link : links_) {
      if (const Status status = link->reject(pair, correspondences, rng); !status.ok()) {
        return status;
      }
    }
    return {};
  }

 private:
  std::vector<std::unique_ptr<CorrespondenceRejector>> links_;
};

}  // namespace grapnel
