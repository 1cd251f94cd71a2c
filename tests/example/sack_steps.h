#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "pipeline/features.h"
#include "tests/example/sack_views.h"
#include "workbench/surfaces.h"

namespace grapnel::example {

/// The detectors that the example compares.
inline constexpr std::array kDetectors = {"sift3d", "harris3d", "principal_curvature"};

/// One detector's keypoints of a pair, and what becomes of them, step by step.
struct Steps {
  std::unique_ptr<StoredSurface> source;  ///< thinned, with normals
  std::unique_ptr<StoredSurface> target;
  std::vector<Keypoint> source_keypoints;
  std::vector<Keypoint> target_keypoints;
  std::vector<Correspondence> matched;  ///< by FPFH, each source keypoint's nearest
  std::vector<Correspondence> kept;     ///< after rejection
};
[[nodiscard]] Steps take_steps(const SackPair& pair, const std::string& detector,
                               const std::string& rejector);

/// Distance within which a keypoint counts as found again: the thinned points' spacing twice.
inline constexpr double kSame_m = 0.012;

/// For each source keypoint whether the target has one at the same place of the sack.
[[nodiscard]] std::vector<bool> found_again(const Steps& steps, const SackPair& pair);
/// Whether the pair of keypoints is one place of the sack.
[[nodiscard]] bool is_right(const Correspondence& correspondence, const Steps& steps,
                            const SackPair& pair);

/// One way through the pipeline.
struct Combination {
  std::string detector;
  std::string rejector;
  std::string generator;
  std::string refiner;  ///< name for the table
  std::vector<std::string> overrides;
};
[[nodiscard]] std::vector<Combination> every_combination();

/// What a combination made of one pair.
struct Outcome {
  PoseError error;
  bool has_pose = false;
  bool accepted = false;
  double ms = 0.0;
  Pose target_from_source = Pose::Identity();

  /// Within what a gripper forgives.
  [[nodiscard]] bool right() const {
    return has_pose && error.shift_m < 0.005 && error.turn_deg < 2.0;
  }
};
/// Registers each pair without initial guess.
[[nodiscard]] std::vector<Outcome> register_pairs(const Combination& combination,
                                                  std::span<const SackPair> pairs);

}  // namespace grapnel::example
