#include "pipeline/coarse/hypothesis_list.h"

#include <cmath>

namespace grapnel {

bool keep_best(Hypotheses& list, const Hypothesis& hypothesis) noexcept {
  if (list.capacity() == 0) return false;
  if (list.full()) {
    if (!(hypothesis.support > list[list.size() - 1].support)) return false;
    list.resize(list.size() - 1);
  }
  std::size_t place = list.size();
  list.resize(list.size() + 1);
  while (place > 0 && hypothesis.support > list[place - 1].support) {
    list[place] = list[place - 1];
    --place;
  }
  list[place] = hypothesis;
  return true;
}

double displacement_m(const Pose& a, const Pose& b, const Vec3d& centre, double radius_m) noexcept {
  // A turn by θ moves the points of a sphere by 2 sin(θ/2) times their distance from the axis,
  // whose root mean square over the sphere is radius · sqrt(2/3).
  const double trace = (a.linear().transpose() * b.linear()).trace();
  const double chord = std::sqrt(std::fmax(0.0, 3.0 - trace));
  const double turn_m = chord * radius_m * 0.8164965809277260;
  const double shift_m = (a * centre - b * centre).norm();
  return std::sqrt(shift_m * shift_m + turn_m * turn_m);
}

}  // namespace grapnel
