#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "pipeline/coarse/distance_field.h"
#include "pipeline/coarse/pose_score.h"
#include "pipeline/coarse/view_templates.h"
#include "pipeline/features.h"
#include "pipeline/limits.h"
#include "pipeline/model.h"
#include "pipeline/refine/closest_point_table.h"
#include "pipeline/self_similarity.h"
#include "pipeline/surface.h"

namespace grapnel {

/// How finely models are represented.
struct ModelIndexParams {
  std::size_t surface_points = 12000;  ///< for refinement and verification
  std::size_t table_voxels = 500000;
  std::size_t samples = 384;
  ViewTemplateParams templates;
};
[[nodiscard]] FieldTable model_index_fields() noexcept;

/// What the pipeline uses of a model, carved into fixed memory and built once, at load.
struct ModelIndex {
  Surface fine;  ///< thinned to an even spacing, in the model's frame
  /// Of each fine point: 1 where the surface around it, as far as measured normals look, is flat.
  std::span<std::uint8_t> flat;
  ClosestPointTable table;
  DistanceField field;
  SampleSet samples;
  ViewTemplates templates;
  Symmetry symmetry = Symmetry::None;
  Vec3d centre = Vec3d::Zero();  ///< of the bounding box, model frame
  double diameter_m = 0.0;       ///< of the bounding box
  bool closed = false;           ///< its surface encloses a volume
  static constexpr std::size_t kSiblings = 12;
  FixedList<Sibling> siblings;  ///< what nearly maps the model onto itself, nearest first
  FixedList<Sibling> mirrored;  ///< and its mirror image onto it; empty where that is the model

  /// Points at the spacing of the measured surfaces, with features made by the preset's own stages.
  Surface coarse;
  ClosestPointTable coarse_table;  ///< small enough to stay near the processor
  KeypointSet keypoints;
  FeatureMatrix features;

  /// The fine points, whose spacing_m is that of the measured surfaces: the unit of distances.
  [[nodiscard]] Surface fixed() const noexcept {
    Surface surface = fine;
    surface.spacing_m = coarse.spacing_m;
    return surface;
  }

  void reserve(Arena& arena, const Model& model, const ModelIndexParams& params,
               const Limits& limits, std::size_t descriptor_dimension);
  /// Builds all but the normals and features of `coarse`, which gets points every `spacing_m`. Load
  /// time: takes memory from the heap for its own use.
  void build(const Model& model, const ModelIndexParams& params, double spacing_m);
};

/// Fills `out` with the mean of the points and normals of each cubic cell and side (the axis
/// direction its normal is nearest to: both faces at an edge stay), in the order of the cells.
/// `spacing_m` gets the cells' edge: `min_spacing_m`, or what makes them fit. Load time.
void thin_model(const Model& model, double min_spacing_m, Surface& out);

}  // namespace grapnel
