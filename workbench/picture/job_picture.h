#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "pipeline/model.h"
#include "workbench/input.h"
#include "workbench/picture/scene_picture.h"

namespace grapnel {

/// A job's target as a depth image: its own, or of a cloud without grid the one that a camera
/// before the cloud's broadest side would have.
struct TargetImage {
  std::vector<std::uint16_t> counts;
  DepthFrame frame;  ///< views `counts` or the input's pixels
  Pose camera_from_target = Pose::Identity();
  bool is_camera = true;  ///< false: no noise law applies
};
[[nodiscard]] TargetImage target_image(const Input& target);

/// What a job is about. Either a model or a source.
struct DrawnJob {
  const Input* target = nullptr;
  const Model* model = nullptr;
  const Input* source = nullptr;
  /// Of the first pose found: the one that it can't be told from. Arrows show what differs.
  std::optional<Pose> rival = std::nullopt;
};

/// Panels of draw_scene() for a job's source at the found poses, target_from_source. Empty when the
/// target has no point.
[[nodiscard]] RgbImage draw_job(const DrawnJob& job, std::span<const Pose> found,
                                const std::optional<Pose>& truth, PictureParams params);

}  // namespace grapnel
