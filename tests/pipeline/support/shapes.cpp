#include "tests/pipeline/support/shapes.h"

#include <algorithm>

#include "base/math.h"
#include "base/rng.h"
#include "tests/pipeline/support/box_scene.h"

namespace grapnel::test {

OwnedSurface box_surface(const Vec3d& size_m) {
  OwnedSurface surface = surface_of(box_cloud(size_m, kShapeSpacing_m));
  surface->spacing_m = kShapeSpacing_m;
  surface->has_viewpoint = false;
  return surface;
}

OwnedSurface barrel_surface(double radius_m, double height_m) {
  OwnedSurface surface(20000, 0);
  const auto add = [&](const Vec3d& p, const Vec3d& n) {
    const std::size_t i = surface->size++;
    surface->x[i] = static_cast<float>(p.x());
    surface->y[i] = static_cast<float>(p.y());
    surface->z[i] = static_cast<float>(p.z());
    surface->nx[i] = static_cast<float>(n.x());
    surface->ny[i] = static_cast<float>(n.y());
    surface->nz[i] = static_cast<float>(n.z());
  };
  const int around = static_cast<int>(2.0 * math::kPi * radius_m / kShapeSpacing_m);
  for (int i = 0; i < around; ++i) {
    const double angle_rad = 2.0 * math::kPi * i / around;
    const Vec3d n(math::cos(angle_rad), math::sin(angle_rad), 0.0);
    for (double z_m = -0.5 * height_m; z_m <= 0.5 * height_m; z_m += kShapeSpacing_m) {
      add(radius_m * n + Vec3d(0.0, 0.0, z_m), n);
    }
    for (double r_m = 0.5 * kShapeSpacing_m; r_m < radius_m; r_m += kShapeSpacing_m) {
      if (i % std::max(1, static_cast<int>(radius_m / r_m)) != 0) continue;
      for (const double side : {1.0, -1.0}) {
        add(r_m * n + Vec3d(0.0, 0.0, 0.5 * side * height_m), Vec3d(0.0, 0.0, side));
      }
    }
  }
  surface->spacing_m = kShapeSpacing_m;
  return surface;
}

OwnedSurface seen(const Surface& model, const Pose& camera_from_model, double sigma_m) {
  OwnedSurface view(model.size, 0);
  Rng rng(7);
  for (std::size_t i = 0; i < model.size; ++i) {
    const Vec3d n = camera_from_model.linear() * model.normal(i).cast<double>();
    Vec3d p = camera_from_model * model.point(i).cast<double>();
    // Of a convex shape all that faces the camera is seen.
    if (n.dot(p.normalized()) > -0.1) continue;
    p += sigma_m * rng.normal() * p.normalized();
    const std::size_t k = view->size++;
    view->x[k] = static_cast<float>(p.x());
    view->y[k] = static_cast<float>(p.y());
    view->z[k] = static_cast<float>(p.z());
    view->nx[k] = static_cast<float>(n.x());
    view->ny[k] = static_cast<float>(n.y());
    view->nz[k] = static_cast<float>(n.z());
  }
  view->spacing_m = model.spacing_m;
  view->has_viewpoint = true;
  return view;
}

}  // namespace grapnel::test
