#include "workbench/picture/point_render.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace grapnel {
namespace {

// Discs of 0.71 spacings close the gaps of a square lattice; points may lie less evenly.
constexpr double kDiscOfSpacing = 1.1;
constexpr float kStepOfDepth = 0.05F;
constexpr double kSteepest = 0.1;

}  // namespace

struct PointRender::Disc {
  double u = 0.0;
  double v = 0.0;
  double radius_px = 0.0;
  Vec3d point = Vec3d::Zero();
  Vec3d normal = Vec3d::Zero();  // zero = none
};

PointRender::PointRender(const Intrinsics& camera)
    : camera_(camera),
      z_(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height), 0.0F),
      cosine_(z_.size(), 1.0F) {}

void PointRender::draw(const Disc& disc) {
  const int reach = std::max(0, static_cast<int>(std::ceil(disc.radius_px)) - 1);
  const int u0 = static_cast<int>(std::floor(disc.u + 0.5));
  const int v0 = static_cast<int>(std::floor(disc.v + 0.5));
  const bool has_normal = disc.normal.squaredNorm() > 0.0;
  for (int v = std::max(0, v0 - reach); v <= std::min(camera_.height - 1, v0 + reach); ++v) {
    for (int u = std::max(0, u0 - reach); u <= std::min(camera_.width - 1, u0 + reach); ++u) {
      const Vec3d ray((u - camera_.cx) / camera_.fx, (v - camera_.cy) / camera_.fy, 1.0);
      double z = disc.point.z();
      double cosine = 1.0;
      if (has_normal) {
        cosine = -disc.normal.dot(ray) / ray.norm();
        if (cosine < kSteepest) continue;
        z = disc.normal.dot(disc.point) / disc.normal.dot(ray);
        if (std::fabs(z - disc.point.z()) > disc.point.z() * kSteepest) continue;
      }
      float& kept = z_[index(u, v)];
      if (kept > 0.0F && static_cast<double>(kept) <= z) continue;
      kept = static_cast<float>(z);
      cosine_[index(u, v)] = static_cast<float>(cosine);
    }
  }
}

void PointRender::add(const PlacedPoints& points) {
  for (std::size_t i = 0; i < points.x.size(); ++i) {
    Disc disc;
    disc.point = points.camera_from_points * Vec3d(points.x[i], points.y[i], points.z[i]);
    if (!disc.point.allFinite() || disc.point.z() <= 0.0) continue;
    if (!points.nx.empty()) {
      disc.normal =
          points.camera_from_points.linear() * Vec3d(points.nx[i], points.ny[i], points.nz[i]);
      if (disc.normal.dot(disc.point) >= 0.0) continue;
    }
    disc.u = camera_.fx * disc.point.x() / disc.point.z() + camera_.cx;
    disc.v = camera_.fy * disc.point.y() / disc.point.z() + camera_.cy;
    disc.radius_px = kDiscOfSpacing * points.spacing_m * camera_.fx / disc.point.z() + 0.5;
    const double far = disc.radius_px + 1.0;
    if (disc.u < -far || disc.v < -far || disc.u > camera_.width + far ||
        disc.v > camera_.height + far) {
      continue;
    }
    draw(disc);
  }
}

bool PointRender::on_outline(int u, int v) const noexcept {
  const float here = z_m(u, v);
  if (!(here > 0.0F)) return false;
  constexpr std::array<std::array<int, 2>, 4> kAround = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  return std::any_of(kAround.begin(), kAround.end(), [&](const std::array<int, 2>& step) {
    const int un = u + step[0];
    const int vn = v + step[1];
    if (un < 0 || vn < 0 || un >= camera_.width || vn >= camera_.height) return true;
    const float there = z_m(un, vn);
    return !(there > 0.0F) || there - here > kStepOfDepth * here;
  });
}

bool PointRender::empty() const noexcept {
  return std::none_of(z_.begin(), z_.end(), [](float z) { return z > 0.0F; });
}

}  // namespace grapnel
