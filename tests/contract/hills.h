#pragma once

#include "tests/pipeline/support/surfaces.h"

namespace grapnel::test {

/// A sheet 0.4 m wide with hills that fit on each other in one way only: about `side` by `side`
/// points on a lattice turned by `turn_rad`, seen from 1 m above, moved by `pose`.
[[nodiscard]] OwnedSurface sheet(int side, double turn_rad, const Pose& pose);

/// How the second of two sheets lies before the first.
[[nodiscard]] Pose truth_of_pair();

}  // namespace grapnel::test
