#pragma once

#include "base/geometry.h"
#include "pipeline/judge/overlap.h"

namespace grapnel {

/// What the overlap of two views says about their relative pose: point-to-plane information about
/// (translation, rotation) at the fixed view's origin, 1/m², 1/rad².
///
/// Noise of the normals alone makes every direction look constrained: a cylinder's normals, each a
/// few degrees off, seem to fix its turn about its own axis, and with many points seem to fix it
/// well. What noise is expected to add, Σ E[δJ δJᵀ], is taken off again; its size comes from how
/// far the normals of partners disagree. A direction of which nothing remains is given next to no
/// information. Needs normals of `fixed.fine`; points of `moved` without one are passed over.
[[nodiscard]] Mat6d overlap_information(const Surface& moved, const OverlapView& fixed,
                                        const Pose& fixed_from_moved, double reach_m) noexcept;

}  // namespace grapnel
