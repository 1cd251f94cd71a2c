#pragma once

#include <cstddef>

#include "base/field.h"

namespace grapnel {

/// Capacities a preset declares; every buffer of the pipeline follows from them.
struct Limits {
  int max_width = 640;
  int max_height = 480;
  std::size_t max_points = 20000;         ///< of a working surface (scene or view) after decimation
  std::size_t max_input_points = 400000;  ///< of an unorganised cloud as read
  std::size_t max_model_points = 20000;
  std::size_t max_keypoints = 1500;  ///< of a scene or a model
  std::size_t max_correspondences = 4096;
  std::size_t max_neighbours = 256;  ///< of one point
  std::size_t max_hypotheses = 64;
  /// Bins of the longest descriptor matched. Not a key of a preset: the descriptor decides.
  std::size_t descriptor_dimension = 160;
};

[[nodiscard]] FieldTable limits_fields() noexcept;

}  // namespace grapnel
