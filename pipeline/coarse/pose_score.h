#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/rng.h"
#include "pipeline/coarse/distance_field.h"
#include "pipeline/coarse/sight_image.h"
#include "pipeline/refine/closest_point_table.h"
#include "pipeline/stage.h"
#include "pipeline/surface.h"

namespace grapnel {

/// A few hundred points of a surface with their normals, in an order in which every beginning of
/// the list covers the whole surface.
struct SampleSet {
  std::span<float> x, y, z, nx, ny, nz;
  std::size_t size = 0;

  void reserve(Arena& arena, std::size_t max_samples);
  /// Takes up to the capacity, spread at random.
  void draw(const Surface& surface, Rng rng) noexcept;

 private:
  std::size_t capacity_ = 0;  // the planes are longer, by what kernels may read
};

/// Quick worth of a pose, by both surfaces' samples: what the camera should see of the model and
/// does, less what it sees through; and what of the measured object the model explains.
/// Microseconds a pose, so that thousands of hypotheses can be tried. 2 is perfect; below 0 is
/// hopeless.
class PoseScore {
 public:
  struct Scene {
    const SightImage* sight = nullptr;         ///< free space is tested where there is one
    const ClosestPointTable* table = nullptr;  ///< else the target's own surface
    const Surface* surface = nullptr;          ///< that the table indexes
    const SampleSet* samples = nullptr;
  };
  struct Model {
    const SampleSet* samples = nullptr;
    const ClosestPointTable* table = nullptr;
    const Surface* surface = nullptr;      ///< that the table indexes
    const DistanceField* field = nullptr;  ///< for glances, where there is one
  };

  PoseScore() = default;
  PoseScore(const Model& model, const Scene& scene, float tolerance_m) noexcept
      : model_(model), scene_(scene), tolerance_m_(tolerance_m) {}

  /// With at most `max_samples` of either side.
  [[nodiscard]] double operator()(const Pose& target_from_source,
                                  std::size_t max_samples) const noexcept;
  /// Sooner and rougher: by the distance field where there is one, and a pose that can't reach
  /// `at_least` gets less than its worth.
  [[nodiscard]] double glance(const Pose& target_from_source, std::size_t max_samples,
                              double at_least) const noexcept;

  /// The pose after a shift alone, that brings the measured samples nearer to the model's surface:
  /// by the mean way to their closest points.
  [[nodiscard]] Pose slid(const Pose& target_from_source, std::size_t max_samples) const noexcept;

 private:
  [[nodiscard]] double seen_share(const Pose& pose, std::size_t max_samples) const noexcept;
  [[nodiscard]] double met_share(const Pose& pose, std::size_t max_samples) const noexcept;
  [[nodiscard]] double near_share(const Pose& pose, std::size_t max_samples) const noexcept;
  [[nodiscard]] double explained_share(const Pose& pose, std::size_t max_samples) const noexcept;

  Model model_;
  Scene scene_;
  float tolerance_m_ = 0.0F;
};

}  // namespace grapnel
