#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "base/depth_frame.h"
#include "base/geometry.h"
#include "workbench/surfaces.h"

namespace grapnel::example {

/// One view of a sack on a belt by the simulated Kinect, the belt cut off by its known plane.
struct SackView {
  std::vector<std::uint16_t> depth;  ///< of the sack alone
  std::vector<Rgb8> color;           ///< of the whole image
  DepthFrame frame;                  ///< of both
  std::unique_ptr<StoredSurface> surface;
};

/// Two views of one sack, whose cameras' directions differ.
struct SackPair {
  SackView source;
  SackView target;
  Pose target_from_source = Pose::Identity();  ///< the truth
  Vec3d middle = Vec3d::Zero();                ///< of the sack, source frame
};

inline constexpr double kApart_deg = 20.0;

/// `seed` makes the sack's wrinkles and print, how it lies, and the sensor's noise.
[[nodiscard]] SackPair render_pair(std::uint64_t seed);

/// How far a pose is from the truth, at the sack's middle.
struct PoseError {
  double shift_m = 0.0;
  double turn_deg = 0.0;
};
[[nodiscard]] PoseError error_of(const Pose& target_from_source, const SackPair& pair);

}  // namespace grapnel::example
