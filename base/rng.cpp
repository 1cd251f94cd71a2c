#include "base/rng.h"

#include <cmath>

namespace grapnel {

double Rng::normal() noexcept {
  const double u = 1.0 - uniform();  // (0, 1]
  const double angle_rad = 2.0 * math::kPi * uniform();
  return std::sqrt(-2.0 * math::log(u)) * math::cos(angle_rad);
}

}  // namespace grapnel
