#pragma once

#include <cstddef>
#include <span>

#include "base/field.h"
#include "pipeline/coarse/triples.h"
#include "pipeline/stage.h"

namespace grapnel {

struct SurfaceRansacParams {
  std::size_t draws = 40000;       ///< triples of pairs tried
  std::size_t ratings = 1500;      ///< poses rated at most
  std::size_t quick_samples = 64;  ///< of a first rating; promising poses get all samples
  double min_edge_ratio = 0.9;
  double min_extent_share = 0.1;  ///< shortest edge of a triple, share of the keypoints' extent
  double max_normal_angle_rad = 0.7;
  double confidence = 1.0;  ///< of a right triple drawn, at which drawing ends; 1 = never
};
[[nodiscard]] FieldTable surface_ransac_fields() noexcept;

/// Poses from random triples of pairs (Fischler and Bolles 1981), with a check of edges before the
/// closed form (as Buch 2013's prerejection) and rated not by pairs but by how well the surfaces
/// agree, which the view's score says: with weak descriptors a right pose then needs only three
/// right pairs, drawn together once.
class SurfaceRansac final : public HypothesisGenerator {
 public:
  explicit SurfaceRansac(const SurfaceRansacParams& params) : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  [[nodiscard]] bool supports_by_score() const noexcept override { return true; }
  /// Without draws no features are asked for, and none are computed.
  [[nodiscard]] bool needs_correspondences() const noexcept override { return params_.draws > 0; }
  Status generate(const PairView& pair, const Correspondences& correspondences, Rng& rng,
                  Hypotheses& hypotheses) noexcept override;

 private:
  [[nodiscard]] std::size_t draws_for(const PairView& pair, const Correspondences& correspondences,
                                      const Pose& target_from_source) const noexcept;

  SurfaceRansacParams params_;
  std::span<PlacedPair> placed_;
};

}  // namespace grapnel
