#include "pipeline/judge/pose_information.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace grapnel {
namespace {

constexpr double kSigmas = 3.0;
// In sensor pixels: as in the verification, nothing is said this near to the part's own steps, and
// an outline is met by an edge this near.
constexpr int kRim_px = 2;
constexpr int kEdgeReach_px = 3;
// Every second pixel both ways stands for its neighbours: they share its error anyway.
constexpr int kStep_px = 2;

// Values of the depth are told apart over this many counts; half a metre of a sensor that speaks in
// millimetres.
constexpr std::size_t kValues = 512;

/// Sums w J times the error of one count's rounding, value by value.
class RoundingSums {
 public:
  void add(std::uint16_t value, const Vec3d& gradient, const Vec3d& x, double weight) noexcept {
    const Vec3d arm = x.cross(gradient);
    std::array<double, 6>& sum = sum_[value % kValues];
    for (int a = 0; a < 3; ++a) {
      sum[static_cast<std::size_t>(a)] += weight * gradient[a];
      sum[static_cast<std::size_t>(a + 3)] += weight * arm[a];
    }
  }
  [[nodiscard]] Mat6d covariance(double variance) const noexcept {
    Mat6d whole = Mat6d::Zero();
    for (const std::array<double, 6>& sum : sum_) {
      if (sum[2] == 0.0) continue;
      for (int a = 0; a < 6; ++a) {
        for (int b = a; b < 6; ++b) {
          whole(a, b) += sum[static_cast<std::size_t>(a)] * sum[static_cast<std::size_t>(b)];
        }
      }
    }
    for (int a = 0; a < 6; ++a) {
      for (int b = a; b < 6; ++b) whole(a, b) = whole(b, a) = variance * whole(a, b);
    }
    return whole;
  }

 private:
  std::array<std::array<double, 6>, kValues> sum_{};
};

/// Sums w J Jᵀ, the upper triangle row by row, and w J times errors.
class Sums {
 public:
  /// A reading that changes by `gradient`·motion when the surface moves at `x`, deviates by `off`,
  /// and by `in_common` where all such readings do.
  void add(const Vec3d& gradient, const Vec3d& x, double weight, const Vec3d& in_common,
           double off) noexcept {
    const Vec3d arm = x.cross(gradient);
    const double j[6] = {gradient.x(), gradient.y(), gradient.z(), arm.x(), arm.y(), arm.z()};
    int k = 0;
    for (int a = 0; a < 6; ++a) {
      const double scaled = weight * j[a];
      for (int b = a; b < 6; ++b) upper_[k++] += scaled * j[b];
      for (int c = 0; c < 3; ++c) common_[a][c] += scaled * in_common[c];
      misfit_[a] += scaled * off;
    }
  }
  [[nodiscard]] PoseReadings readings() const noexcept {
    PoseReadings readings;
    int k = 0;
    for (int a = 0; a < 6; ++a) {
      for (int b = a; b < 6; ++b) {
        readings.information(a, b) = readings.information(b, a) = upper_[k++];
      }
      for (int c = 0; c < 3; ++c) readings.common(a, c) = common_[a][c];
      readings.misfit[a] = misfit_[a];
    }
    return readings;
  }

 private:
  double upper_[21] = {};
  double common_[6][3] = {};
  double misfit_[6] = {};
};

void add_surface(const Surface& model, const Eigen::Matrix3f& rotation, const ModelRender& render,
                 const DepthView& view, const ReadingSpread& spread, RoundingSums& rounding,
                 Sums& sums) noexcept {
  const PixelBox& box = render.marked();
  const double stride_px = view.stride;
  // Pixels of the view that one error counts for, each looked at standing for kStep_px².
  const double shared = std::max(1.0, spread.shared_px / (stride_px * stride_px));
  const double each = kStep_px * kStep_px / shared;
  for (int v = box.v0; v < box.v1; v += kStep_px) {
    for (int u = box.u0; u < box.u1; u += kStep_px) {
      const float predicted = render.z_m(u, v);
      if (!(predicted > 0.0F) || !view.of_object(u, v)) continue;
      const double sigma_m = static_cast<double>(view.noise.sigma_m(predicted));
      const auto limit = static_cast<float>(std::max(kSigmas * sigma_m, spread.floor_m));
      if (render.at_step(u, v, view.own_px(kRim_px), limit)) continue;
      const Vec3d ray((u - view.intrinsics.cx) / view.intrinsics.fx,
                      (v - view.intrinsics.cy) / view.intrinsics.fy, 1.0);
      const Vec3d normal =
          (rotation * model.normal(static_cast<std::size_t>(render.point(u, v)))).cast<double>();
      const double along = normal.dot(ray);
      const double off_m = static_cast<double>(view.z_m(u, v) - predicted) * along;
      if (std::fabs(off_m) > static_cast<double>(limit)) continue;
      // Of the distance from the surface: what the reading errs along the ray and across it.
      const double across_m =
          spread.across_px * static_cast<double>(predicted) / (view.intrinsics.fx * stride_px);
      const double square = along * along / ray.squaredNorm();
      const double variance_m2 =
          sigma_m * sigma_m * along * along + across_m * across_m * std::max(0.0, 1.0 - square);
      sums.add(normal, static_cast<double>(predicted) * ray, each / variance_m2,
               {0.0, 0.0, sigma_m * along}, off_m);
      rounding.add(view.depth.at(u, v), normal, static_cast<double>(predicted) * ray,
                   each / variance_m2 * along);
    }
  }
}

void add_outline(const ModelRender& render, const DepthView& view, const EdgeMap& edges,
                 const Surface& model, const Pose& pose, const ReadingSpread& spread,
                 Sums& sums) noexcept {
  const int reach = view.own_px(kEdgeReach_px);
  // In pixels of the view, which says no better than to one of them where an edge is.
  const double stride_px = view.stride;
  const double variance_px2 =
      spread.outline_px * spread.outline_px / (stride_px * stride_px) + 1.0 / 12.0;
  const double shared = std::max(1.0, std::sqrt(spread.shared_px) / stride_px);
  for (const ContourPoint& point : render.contour()) {
    const int u = static_cast<int>(std::floor(point.u + 0.5F));
    const int v = static_cast<int>(std::floor(point.v + 0.5F));
    const EdgeMap::Nearest edge = edges.nearest(u, v, reach);
    if (!edge.found) continue;
    const Vec3d x = pose * model.point(static_cast<std::size_t>(point.point)).cast<double>();
    const double out_u = static_cast<double>(point.out_u) * view.intrinsics.fx / x.z();
    const double out_v = static_cast<double>(point.out_v) * view.intrinsics.fy / x.z();
    const Vec3d gradient(out_u, out_v, -(out_u * x.x() + out_v * x.y()) / x.z());
    const Vec3d shifted(static_cast<double>(point.out_u), static_cast<double>(point.out_v), 0.0);
    const double off_px =
        static_cast<double>(point.out_u) * (edge.u - static_cast<double>(point.u)) +
        static_cast<double>(point.out_v) * (edge.v - static_cast<double>(point.v));
    sums.add(gradient, x, 1.0 / (variance_px2 * shared), shifted / stride_px, off_px);
  }
}

}  // namespace

PoseReadings pose_information(const Surface& model, const Pose& camera_from_model,
                              const ModelRender& render, const DepthView& view,
                              const EdgeMap& edges, const ReadingSpread& spread) noexcept {
  Sums sums;
  RoundingSums rounding;
  add_surface(model, camera_from_model.linear().cast<float>(), render, view, spread, rounding,
              sums);
  add_outline(render, view, edges, model, camera_from_model, spread, sums);
  PoseReadings readings = sums.readings();
  // An error that is even over one unit has a twelfth of its square for variance.
  const auto unit_m = static_cast<double>(view.metres_per_unit);
  readings.rounding = rounding.covariance(unit_m * unit_m / 12.0);
  return readings;
}

}  // namespace grapnel
