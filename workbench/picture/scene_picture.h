#pragma once

#include <span>

#include "base/depth_frame.h"
#include "workbench/picture/point_render.h"
#include "workbench/picture/rgb_image.h"

namespace grapnel {

/// Colours of the panels, for legends.
inline constexpr Rgb8 kFoundColor = {235, 110, 20};
inline constexpr Rgb8 kRivalColor = {170, 0, 170};
inline constexpr Rgb8 kTruthColor = {0, 190, 220};
inline constexpr Rgb8 kMatchedColor = {60, 175, 75};
inline constexpr Rgb8 kContradictedColor = {220, 40, 40};
inline constexpr Rgb8 kOccludedColor = {60, 110, 220};
inline constexpr Rgb8 kUnknownColor = {150, 150, 150};

/// A stretch in the camera's frame, with a mark at its end.
struct DrawnArrow {
  Vec3d from = Vec3d::Zero();
  Vec3d to = Vec3d::Zero();
  Rgb8 color = kFoundColor;
};

struct PictureParams {
  int panel_px = 220;            ///< longer side of a panel
  bool whole_image = false;      ///< else what lies about the poses
  double sigma_1m_m = 0.001425;  ///< depth noise at 1 m, growing with z²
  double floor_m = 0.004;        ///< a sample matches within this and three sigma
};

/// Three panels: the depth image, shaded; on it the found poses with their outline and, of the
/// truth, the outline; and each pixel of the found poses coloured by what the measurement says:
/// matched, contradicted (measured behind it: the camera sees through), occluded (measured before
/// it), unknown (no reading). Without poses the first two panels of the whole image. The arrows
/// come on the second panel.
[[nodiscard]] RgbImage draw_scene(const DepthFrame& frame, std::span<const PlacedPoints> found,
                                  std::span<const PlacedPoints> truth, const PictureParams& params,
                                  std::span<const DrawnArrow> arrows = {});

}  // namespace grapnel
