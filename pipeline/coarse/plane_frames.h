#pragma once

#include <array>
#include <cstddef>

#include "base/field.h"
#include "pipeline/coarse/plane_patches.h"
#include "pipeline/coarse/pose_finalists.h"
#include "pipeline/stage.h"

namespace grapnel {

struct PlaneFramesParams {
  std::size_t trials = 48;            ///< points tried for each plane
  double thickness_ratio = 0.6;       ///< half thickness of a plane, spacings
  double max_normal_angle_rad = 0.5;  ///< of a point's normal from its plane's
  double min_share = 0.05;            ///< of all points, of a plane
  double max_angle_rad = 0.2;         ///< by which angles between planes may differ
  std::size_t ratings = 3000;         ///< poses looked at, at most
  std::size_t quick_samples = 48;     ///< of a first rating
};
[[nodiscard]] FieldTable plane_frames_fields() noexcept;

/// Poses from the planes of both surfaces, for boxes and other flat-sided parts without features.
/// Three planes make a corner and fix the pose; two make an edge, along which either end or the
/// middle of both is brought together; one is placed by the rectangle around it, by its middle and
/// by each corner, so that a part half hidden is found too. Needs the view's score; correspondences
/// are not looked at.
class PlaneFrames final : public HypothesisGenerator {
 public:
  explicit PlaneFrames(const PlaneFramesParams& params) : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  [[nodiscard]] bool supports_by_score() const noexcept override { return true; }
  [[nodiscard]] bool needs_correspondences() const noexcept override { return false; }
  Status generate(const PairView& pair, const Correspondences& correspondences, Rng& rng,
                  Hypotheses& hypotheses) noexcept override;

 private:
  struct Edge {
    std::size_t first = 0, second = 0;
  };
  void try_edges(const PairView& pair) noexcept;
  bool try_edge(const PairView& pair, Edge target, Edge source) noexcept;
  void try_faces(const PairView& pair) noexcept;
  bool try_face(std::size_t target, std::size_t source) noexcept;
  /// A third pair of planes across the edge: its row of the equations of the shift.
  [[nodiscard]] bool third_plane(const Mat3d& rotation, Edge target, const Vec3d& edge, Vec3d& row,
                                 double& right_m) const noexcept;

  PlaneFramesParams params_;
  PlanePatches source_;
  PlanePatches target_;
  std::array<PlanePatches::Rectangle, PlanePatches::kMost> source_faces_{};
  std::array<PlanePatches::Rectangle, PlanePatches::kMost> target_faces_{};
  PoseFinalists finalists_;
};

}  // namespace grapnel
