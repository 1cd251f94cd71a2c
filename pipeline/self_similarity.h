#pragma once

#include <cstddef>

#include "base/fixed_list.h"
#include "base/geometry.h"
#include "pipeline/model.h"
#include "pipeline/refine/closest_point_table.h"
#include "pipeline/surface.h"

namespace grapnel {

/// A motion that nearly maps a model onto itself: a pose and its sibling, pose · motion, look alike
/// except where the model tells them apart.
struct Sibling {
  Pose motion = Pose::Identity();
  double share = 0.0;  ///< of the model's points that it carries onto the model's surface
};

/// Fills `siblings` with the motions, the best as many as fit, that keep at least 60 % of the
/// surface, differ from standing still and from each other modulo the declared symmetry, each
/// refined by registering the model to itself. Rotations are tried every 14 degrees, evenly (Alexa,
/// Super-Fibonacci spirals, 2022), and shifts along the axes. Load time, some ten milliseconds.
void find_siblings(const Surface& surface, const ClosestPointTable& table, const Vec3d& centre,
                   double diameter_m, Symmetry symmetry, FixedList<Sibling>& siblings);

/// A model as finely as it is known.
struct FineModel {
  const Surface& surface;
  const ClosestPointTable& table;
  bool closed = false;  ///< encloses a volume
};

/// The same for the model's mirror image: `siblings` gets the motions composed with a reflection
/// (their linear part has determinant -1) that carry most of the model onto itself. None where the
/// model is its own mirror image, within what readings tell. Load time, some ten milliseconds.
void find_mirrored_siblings(const FineModel& fine, const Surface& surface,
                            const ClosestPointTable& table, const Vec3d& centre, double diameter_m,
                            Symmetry symmetry, FixedList<Sibling>& siblings);

}  // namespace grapnel
