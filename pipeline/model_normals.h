#pragma once

#include "pipeline/model.h"

namespace grapnel {

/// Mean distance of a point to its nearest other point, over an even selection. Load time.
[[nodiscard]] double mean_nearest_distance_m(const Model& model);

/// Fills the normals: least-squares plane through each point's neighbours, made to agree along a
/// spanning tree of the flattest steps (Hoppe 1992), then turned so that the whole points away from
/// the cloud's centre. Load time; takes memory from the heap. O(n log n).
void estimate_model_normals(Model& model);

}  // namespace grapnel
