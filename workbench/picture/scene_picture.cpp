#include "workbench/picture/scene_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace grapnel {
namespace {

constexpr Rgb8 kNoReading = {24, 28, 44};
constexpr int kGap_px = 4;
// About the poses, as a share of their own extent.
constexpr double kMargin = 0.2;
constexpr int kLeastCrop_px = 48;
constexpr float kSteepest = 0.17F;
// Slopes are taken over this many pixels, and greys in steps: noise shows less and packs better.
constexpr int kSlope_px = 4;
constexpr int kGrays = 16;

/// Part of an image, in its pixels.
struct Crop {
  int left = 0;
  int top = 0;
  int right = 0;
  int bottom = 0;
};

/// Where poses show, a margin about them; the whole image when they show nowhere.
Crop crop_about(const PointRender& poses, bool whole) {
  const int width = poses.camera().width;
  const int height = poses.camera().height;
  Crop crop{width, height, 0, 0};
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      if (!(poses.z_m(u, v) > 0.0F)) continue;
      crop.left = std::min(crop.left, u);
      crop.right = std::max(crop.right, u + 1);
      crop.top = std::min(crop.top, v);
      crop.bottom = std::max(crop.bottom, v + 1);
    }
  }
  if (whole || crop.right <= crop.left) return {0, 0, width, height};
  const int extent = std::max(crop.right - crop.left, crop.bottom - crop.top);
  const int margin = std::max(static_cast<int>(kMargin * extent), kLeastCrop_px - extent / 2);
  return {std::max(0, crop.left - margin), std::max(0, crop.top - margin),
          std::min(width, crop.right + margin), std::min(height, crop.bottom + margin)};
}

/// A camera whose image is the crop at the panel's size, and the depth resampled to it.
struct Panel {
  Intrinsics camera;
  std::vector<float> z_m;

  Panel(const DepthFrame& frame, const Crop& crop, int panel_px) {
    const int width = crop.right - crop.left;
    const int height = crop.bottom - crop.top;
    const double scale = static_cast<double>(panel_px) / std::max(width, height);
    const Intrinsics& k = frame.intrinsics;
    camera = {std::max(1, static_cast<int>(scale * width)),
              std::max(1, static_cast<int>(scale * height)),
              k.fx * scale,
              k.fy * scale,
              (k.cx - crop.left + 0.5) * scale - 0.5,
              (k.cy - crop.top + 0.5) * scale - 0.5};
    z_m.reserve(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
    for (int v = 0; v < camera.height; ++v) {
      for (int u = 0; u < camera.width; ++u) {
        const int su = std::min(crop.right - 1, crop.left + static_cast<int>((u + 0.5) / scale));
        const int sv = std::min(crop.bottom - 1, crop.top + static_cast<int>((v + 0.5) / scale));
        z_m.push_back(static_cast<float>(frame.depth.at(su, sv) * frame.metres_per_unit));
      }
    }
  }
  [[nodiscard]] float at(int u, int v) const noexcept {
    return z_m[static_cast<std::size_t>(v) * static_cast<std::size_t>(camera.width) +
               static_cast<std::size_t>(u)];
  }
};

/// Depth between the 2nd and 98th percentile from light to dark, shaded by its slope.
RgbImage shade(const Panel& panel) {
  std::vector<float> sorted;
  std::copy_if(panel.z_m.begin(), panel.z_m.end(), std::back_inserter(sorted),
               [](float z) { return z > 0.0F; });
  std::sort(sorted.begin(), sorted.end());
  const float near_m = sorted.empty() ? 0.0F : sorted[sorted.size() / 50];
  const float far_m = sorted.empty() ? 1.0F : sorted[sorted.size() - 1 - sorted.size() / 50];
  RgbImage image(panel.camera.width, panel.camera.height, kNoReading);
  for (int v = 0; v < image.height(); ++v) {
    for (int u = 0; u < image.width(); ++u) {
      const float z = panel.at(u, v);
      if (!(z > 0.0F)) continue;
      const float t = std::clamp((z - near_m) / std::max(far_m - near_m, 0.01F), 0.0F, 1.0F);
      const float right = panel.at(std::min(u + kSlope_px, image.width() - 1), v);
      const float below = panel.at(u, std::min(v + kSlope_px, image.height() - 1));
      const auto step_m = static_cast<float>(kSlope_px * static_cast<double>(z) / panel.camera.fx);
      const float slope_u = right > 0.0F ? (right - z) / step_m : 0.0F;
      const float slope_v = below > 0.0F ? (below - z) / step_m : 0.0F;
      const float light = (1.0F + 0.5F * slope_u + 0.7F * slope_v) /
                          (std::sqrt(1.0F + slope_u * slope_u + slope_v * slope_v) * 1.05F);
      const float value = (225.0F - 120.0F * t) * std::clamp(0.35F + 0.65F * light, 0.25F, 1.1F);
      const auto gray = static_cast<std::uint8_t>(
          static_cast<int>(std::clamp(value, 0.0F, 255.0F)) / kGrays * kGrays);
      image.at(u, v) = {gray, gray, gray};
    }
  }
  return image;
}

Rgb8 judged(float predicted, float cosine, float measured, const PictureParams& params) {
  if (!(measured > 0.0F)) return kUnknownColor;
  const double z = static_cast<double>(predicted);
  const double limit_m = std::max(3.0 * params.sigma_1m_m * z * z, params.floor_m);
  const double off_m =
      static_cast<double>(measured - predicted) * static_cast<double>(std::max(kSteepest, cosine));
  if (off_m > limit_m) return kContradictedColor;
  return off_m < -limit_m ? kOccludedColor : kMatchedColor;
}

void draw_outline(const PointRender& render, const Rgb8& color, RgbImage& image) {
  for (int v = 0; v < image.height(); ++v) {
    for (int u = 0; u < image.width(); ++u) {
      if (render.on_outline(u, v)) image.at(u, v) = color;
    }
  }
}

/// Two pixels broad, its last pixels broader; what is behind the camera is left out.
void draw_arrow(const DrawnArrow& arrow, const Intrinsics& camera, RgbImage& image) {
  constexpr int kSteps = 200;
  constexpr int kHeadSteps = 12;
  for (int i = 0; i <= kSteps; ++i) {
    const Vec3d p = arrow.from + (arrow.to - arrow.from) * (static_cast<double>(i) / kSteps);
    if (!(p.z() > 0.0)) continue;
    const int u = static_cast<int>(std::floor(camera.fx * p.x() / p.z() + camera.cx));
    const int v = static_cast<int>(std::floor(camera.fy * p.y() / p.z() + camera.cy));
    const int reach = i > kSteps - kHeadSteps ? 2 : 0;
    for (int dv = -reach; dv <= reach + 1; ++dv) {
      for (int du = -reach; du <= reach + 1; ++du) {
        if (image.contains(u + du, v + dv)) image.at(u + du, v + dv) = arrow.color;
      }
    }
  }
}

PointRender rendered(const Intrinsics& camera, std::span<const PlacedPoints> all) {
  PointRender render(camera);
  for (const PlacedPoints& points : all) render.add(points);
  return render;
}

}  // namespace

RgbImage draw_scene(const DepthFrame& frame, std::span<const PlacedPoints> found,
                    std::span<const PlacedPoints> truth, const PictureParams& params,
                    std::span<const DrawnArrow> arrows) {
  Intrinsics camera = frame.intrinsics;
  camera.width = frame.depth.width;
  camera.height = frame.depth.height;
  PointRender all = rendered(camera, found);
  for (const PlacedPoints& points : truth) all.add(points);
  const Panel panel(frame, crop_about(all, params.whole_image), params.panel_px);
  std::vector<RgbImage> panels;
  panels.push_back(shade(panel));
  RgbImage overlay = panels[0];
  RgbImage samples = panels[0];
  for (const PlacedPoints& points : found) {
    const PointRender one = rendered(panel.camera, {&points, 1});
    for (int v = 0; v < overlay.height(); ++v) {
      for (int u = 0; u < overlay.width(); ++u) {
        const float z = one.z_m(u, v);
        if (!(z > 0.0F)) continue;
        overlay.at(u, v) = blended(overlay.at(u, v), kFoundColor, 0.25);
        samples.at(u, v) =
            blended(samples.at(u, v), judged(z, one.cosine(u, v), panel.at(u, v), params), 0.75);
      }
    }
    draw_outline(one, kFoundColor, overlay);
  }
  for (const PlacedPoints& points : truth) {
    draw_outline(rendered(panel.camera, {&points, 1}), kTruthColor, overlay);
  }
  for (const DrawnArrow& arrow : arrows) draw_arrow(arrow, panel.camera, overlay);
  panels.push_back(std::move(overlay));
  if (!found.empty()) panels.push_back(std::move(samples));
  return side_by_side(panels, kGap_px);
}

}  // namespace grapnel
