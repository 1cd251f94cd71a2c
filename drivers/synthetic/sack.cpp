#include <algorithm>
#include <array>
#include <cmath>

#include "base/math.h"
#include "base/rng.h"
#include "drivers/synthetic/shapes.h"

namespace grapnel {
namespace {

constexpr int kSegments = 64;  // per side: facets of about 8 mm on a sack of half a metre

/// A packet of parallel ridges that fades out at its radius.
struct Wrinkle {
  double x_m;
  double y_m;
  double radius_m;
  double direction_x;
  double direction_y;
  double wave_m;
  double phase_rad;
  double height_m;

  [[nodiscard]] double at(double x, double y) const {
    const double dx = x - x_m;
    const double dy = y - y_m;
    const double r2 = (dx * dx + dy * dy) / (radius_m * radius_m);
    if (r2 >= 1.0) return 0.0;
    const double along_m = dx * direction_x + dy * direction_y;
    const double window = (1.0 - r2) * (1.0 - r2);
    return height_m * window * math::cos(2.0 * math::kPi * along_m / wave_m + phase_rad);
  }
};

/// The cloth's shape apart from the pillow: where the filling lies, wrinkles and one deep fold.
struct Cloth {
  double slope_x;
  double slope_y;
  std::array<Wrinkle, 9> wrinkles;
  double fold_x;
  double fold_y;
  double fold_offset_m;
  double fold_width_m;
  double fold_depth_m;

  Cloth(const Vec3d& size_m, std::uint64_t seed) {
    Rng rng(seed);
    slope_x = (rng.uniform() < 0.5 ? -1.0 : 1.0) * rng.uniform(0.22, 0.32);
    slope_y = (rng.uniform() < 0.5 ? -1.0 : 1.0) * rng.uniform(0.10, 0.20);
    for (Wrinkle& wrinkle : wrinkles) {
      const double angle_rad = rng.uniform(0.0, math::kPi);
      wrinkle.x_m = rng.uniform(-0.38, 0.38) * size_m.x();
      wrinkle.y_m = rng.uniform(-0.38, 0.38) * size_m.y();
      wrinkle.radius_m = rng.uniform(0.20, 0.36) * size_m.y() + 0.04;
      wrinkle.direction_x = math::cos(angle_rad);
      wrinkle.direction_y = math::sin(angle_rad);
      wrinkle.wave_m = rng.uniform(0.06, 0.12);
      wrinkle.phase_rad = rng.uniform(0.0, 2.0 * math::kPi);
      wrinkle.height_m = rng.uniform(0.004, 0.009);
    }
    const double angle_rad = rng.uniform(0.2, 0.9);
    fold_x = math::cos(angle_rad);
    fold_y = math::sin(angle_rad);
    fold_offset_m = rng.uniform(0.05, 0.15) * size_m.x();
    fold_width_m = 0.035;
    fold_depth_m = 0.018;
  }

  [[nodiscard]] double relief_m(double x, double y) const {
    double sum = 0.0;
    for (const Wrinkle& wrinkle : wrinkles) sum += wrinkle.at(x, y);
    const double across = (x * fold_x + y * fold_y - fold_offset_m) / fold_width_m;
    if (std::fabs(across) < 1.0) {
      const double window = (1.0 - across * across) * (1.0 - across * across);
      sum -= fold_depth_m * window;
    }
    return sum;
  }
};

}  // namespace

Mesh make_sack(const Vec3d& size_m, std::uint64_t seed) {
  const Cloth cloth(size_m, seed);
  Mesh mesh;
  constexpr int kRow = kSegments + 1;
  // Both sheets are sampled at s = sin(angle): dense at the seam, where the pillow is steep.
  for (const bool upper : {true, false}) {
    for (int j = 0; j <= kSegments; ++j) {
      const double t_rad = math::kPi * (static_cast<double>(j) / kSegments - 0.5);
      for (int i = 0; i <= kSegments; ++i) {
        const double s_rad = math::kPi * (static_cast<double>(i) / kSegments - 0.5);
        const double s = math::sin(s_rad);
        const double t = math::sin(t_rad);
        const double seam = std::max(0.0, math::cos(s_rad) * math::cos(t_rad));
        // The seam draws in where the sack is full.
        const double x = 0.5 * size_m.x() * s * (1.0 - 0.05 * (1.0 - t * t));
        const double y = 0.5 * size_m.y() * t * (1.0 - 0.05 * (1.0 - s * s));
        double z = 0.0;
        if (upper) {
          const double full = 1.0 + cloth.slope_x * s + cloth.slope_y * t;
          z = 0.72 * size_m.z() * seam * full + cloth.relief_m(x, y) * std::min(1.0, 3.0 * seam);
        } else {
          z = -0.28 * size_m.z() * seam * (2.0 - seam);
        }
        const bool on_seam = i == 0 || j == 0 || i == kSegments || j == kSegments;
        mesh.add_vertex({x, y, on_seam ? 0.0 : z});
      }
    }
  }
  for (std::uint32_t j = 0; j < kSegments; ++j) {
    for (std::uint32_t i = 0; i < kSegments; ++i) {
      const std::uint32_t top = j * kRow + i;
      const std::uint32_t bottom = top + kRow * kRow;
      mesh.add_quad(top, top + 1, top + 1 + kRow, top + kRow);
      mesh.add_quad(bottom + kRow, bottom + kRow + 1, bottom + 1, bottom);
    }
  }
  centre(mesh);
  const Vec3d scale = size_m.cwiseQuotient(bounds_of(mesh).size_m());
  for (Vec3d& vertex : mesh.vertices) vertex = vertex.cwiseProduct(scale);
  return mesh;
}

}  // namespace grapnel
