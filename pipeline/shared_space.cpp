#include "pipeline/shared_space.h"

#include <algorithm>

namespace grapnel {
namespace {

// Length of the mean normal of an evenly sampled surface: 0 when closed, 1 for one flat face. A
// box without its bottom, 0.4 x 0.3 x 0.2 m, has 0.23.
constexpr float kClosed = 0.15F;

bool lies_inside(const Vec3f& p, const ModelIndex& around, double depth_m) noexcept {
  const std::int32_t found = around.table.closest(p, static_cast<float>(around.diameter_m));
  if (found < 0) return false;
  const auto q = static_cast<std::size_t>(found);
  const Vec3f off = around.fine.point(q) - p;
  return off.dot(around.fine.normal(q)) > static_cast<float>(depth_m);
}

double share_inside(const Surface& points, const Pose& around_from_points, const ModelIndex& around,
                    double depth_m) noexcept {
  const Eigen::Matrix3f rotation = around_from_points.linear().cast<float>();
  const Vec3f shift = around_from_points.translation().cast<float>();
  std::size_t inside = 0;
  for (std::size_t i = 0; i < points.size; ++i) {
    if (lies_inside(rotation * points.point(i) + shift, around, depth_m)) ++inside;
  }
  return points.size == 0 ? 0.0 : static_cast<double>(inside) / static_cast<double>(points.size);
}

}  // namespace

bool encloses_volume(const Surface& model) noexcept {
  Vec3f sum = Vec3f::Zero();
  for (std::size_t i = 0; i < model.size; ++i) sum += model.normal(i);
  return model.size > 0 && sum.norm() < kClosed * static_cast<float>(model.size);
}

double shared_space(const ModelIndex& a, const Pose& target_from_a, const ModelIndex& b,
                    const Pose& target_from_b, double depth_m) noexcept {
  const double apart_m = (target_from_a * a.centre - target_from_b * b.centre).norm();
  if (apart_m > 0.5 * (a.diameter_m + b.diameter_m)) return 0.0;
  const Pose b_from_a = target_from_b.inverse() * target_from_a;
  const auto middle = [](const Pose& to_from, const ModelIndex& model) {
    return Vec3f((to_from * model.centre).cast<float>());
  };
  if (b.closed && lies_inside(middle(b_from_a, a), b, depth_m)) return 1.0;
  if (a.closed && lies_inside(middle(b_from_a.inverse(), b), a, depth_m)) return 1.0;
  double share = 0.0;
  if (b.closed) share = std::max(share, share_inside(a.coarse, b_from_a, b, depth_m));
  if (a.closed) share = std::max(share, share_inside(b.coarse, b_from_a.inverse(), a, depth_m));
  return share;
}

}  // namespace grapnel
