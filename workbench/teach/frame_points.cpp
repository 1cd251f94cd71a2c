#include "workbench/teach/frame_points.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <optional>

#include "workbench/input.h"

namespace grapnel {
namespace {

constexpr int kHalfWindow_px = 3;
// Of the 49 pixels of the window; fewer means an edge, where readings mix two surfaces.
constexpr int kMinPixels = 30;
// Beyond 75 degrees structured light readings are mostly interpolation.
constexpr double kMinCosine = 0.26;
// Axial noise of structured light is about this times z² (Khoshelham and Elberink 2012).
constexpr double kNoise_per_m = 1.425e-3;

bool masked_out(ImageView<const Rgb8> mask, int u, int v) {
  return !mask.empty() && mask.at(u, v) == Rgb8{};
}

/// Neighbours on the same surface: those whose depth differs by no more than a plane seen at
/// 75 degrees explains.
std::vector<Vec3d> window_points(const DepthFrame& frame, int u, int v, const Vec3f& centre) {
  const double pitch_m = centre.z() / frame.intrinsics.fx;
  std::vector<Vec3d> points;
  for (int y = std::max(0, v - kHalfWindow_px);
       y <= std::min(frame.depth.height - 1, v + kHalfWindow_px); ++y) {
    for (int x = std::max(0, u - kHalfWindow_px);
         x <= std::min(frame.depth.width - 1, u + kHalfWindow_px); ++x) {
      const Vec3f point = point_of_pixel(frame, x, y);
      const double steps = std::sqrt(static_cast<double>((x - u) * (x - u) + (y - v) * (y - v)));
      const double z = static_cast<double>(centre.z());
      const double limit_m = 3.0 * kNoise_per_m * z * z + 4.0 * steps * pitch_m;
      if (point.allFinite() && std::abs(static_cast<double>(point.z()) - z) <= limit_m) {
        points.push_back(point.cast<double>());
      }
    }
  }
  return points;
}

std::optional<Vec3f> plane_normal(const std::vector<Vec3d>& points) {
  Vec3d mean = Vec3d::Zero();
  for (const Vec3d& point : points) mean += point;
  mean /= static_cast<double>(points.size());
  Mat3d scatter = Mat3d::Zero();
  for (const Vec3d& point : points) scatter += (point - mean) * (point - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3d> solver(scatter);
  if (solver.info() != Eigen::Success || !(solver.eigenvalues()[1] > 0.0)) return std::nullopt;
  return solver.eigenvectors().col(0).cast<float>();
}

}  // namespace

std::vector<SurfaceSample> frame_samples(const DepthFrame& frame, ImageView<const Rgb8> mask) {
  std::vector<SurfaceSample> samples;
  for (int v = 0; v < frame.depth.height; ++v) {
    for (int u = 0; u < frame.depth.width; ++u) {
      const Vec3f point = point_of_pixel(frame, u, v);
      if (!point.allFinite() || masked_out(mask, u, v)) continue;
      const std::vector<Vec3d> window = window_points(frame, u, v, point);
      if (window.size() < kMinPixels) continue;
      std::optional<Vec3f> normal = plane_normal(window);
      if (!normal) continue;
      const double cosine = -static_cast<double>(normal->dot(point.normalized()));
      if (std::abs(cosine) < kMinCosine) continue;
      const double z = static_cast<double>(point.z());
      const double sigma_m = kNoise_per_m * z * z / std::abs(cosine);
      SurfaceSample sample;
      sample.point = point;
      sample.normal = cosine > 0.0 ? *normal : Vec3f(-*normal);
      sample.weight = static_cast<float>(1.0 / (sigma_m * sigma_m));
      if (!frame.color.empty()) {
        const Rgb8& color = frame.color.at(u, v);
        sample.intensity = (0.299F * color.r + 0.587F * color.g + 0.114F * color.b) / 255.0F;
      }
      samples.push_back(sample);
    }
  }
  return samples;
}

}  // namespace grapnel
