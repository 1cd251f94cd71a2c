#pragma once

#include <array>
#include <span>

#include "base/geometry.h"
#include "pipeline/model.h"

namespace grapnel {

/// Squared error over predicted variance along x y z and about x y z of the source's axes, in a
/// frame at the centre of its points (normalised estimation error squared, NEES: 1 on the average
/// where the prediction is right). NaN about an axis that `symmetry` leaves free. `covariance` as
/// of RegistrationReport: at the target's origin, translations first. For errors below about 20°.
[[nodiscard]] std::array<double, 6> normalised_squared_errors(const Pose& found, const Pose& truth,
                                                              const Mat6d& covariance,
                                                              Symmetry symmetry,
                                                              std::span<const Vec3f> source_points);

}  // namespace grapnel
