#pragma once

#include "base/geometry.h"

namespace grapnel {

/// How far the best pose is ahead of the nearest distinct one, 0…1, and which that is.
struct Margin {
  double value = 1.0;
  const Pose* rival = nullptr;  ///< null where none was looked at closely
};

}  // namespace grapnel
