#include "workbench/teach/model_quality.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/math.h"

namespace grapnel {
namespace {

constexpr int kDirections = 500;
constexpr double kCosNear = 0.8660254037844386;  // 30 degrees
constexpr int kQualitySize_px = 160;
constexpr int kQualityDirections = 42;
constexpr Rgb8 kBackground = {255, 255, 255};

/// Evenly spread directions: the golden spiral (Swinbank and Purser 2006).
Vec3d spiral_direction(int i, int count) {
  constexpr double kGoldenAngle_rad = 2.399963229728653;
  const double z = 1.0 - (2.0 * i + 1.0) / count;
  const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
  return {r * math::cos(kGoldenAngle_rad * i), r * math::sin(kGoldenAngle_rad * i), z};
}

struct Ball {
  Vec3d centre = Vec3d::Zero();
  double radius_m = 0.0;
};

/// Around the bounding box's centre.
Ball ball_around(const CloudData& cloud) {
  Vec3d low = Vec3d::Constant(std::numeric_limits<double>::max());
  Vec3d high = -low;
  const auto point = [&](std::size_t i) { return Vec3d(cloud.x[i], cloud.y[i], cloud.z[i]); };
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    low = low.cwiseMin(point(i));
    high = high.cwiseMax(point(i));
  }
  Ball ball;
  if (cloud.size() == 0) return ball;
  ball.centre = 0.5 * (low + high);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    ball.radius_m = std::max(ball.radius_m, (point(i) - ball.centre).norm());
  }
  return ball;
}

/// A picture being drawn, with its depth.
class Canvas {
 public:
  Canvas(int size_px, double pixel_m, const Vec3d& centre, const Vec3d& toward_viewer)
      : size_px_(size_px), pixel_m_(pixel_m), centre_(centre), out_(toward_viewer.normalized()) {
    // Cameras have y down: an upright picture of the first camera's view.
    const Vec3d down = std::abs(out_.y()) < 0.9 ? Vec3d::UnitY() : Vec3d::UnitZ();
    right_ = down.cross(-out_).normalized();
    down_ = (-out_).cross(right_);
    const auto pixels = static_cast<std::size_t>(size_px) * static_cast<std::size_t>(size_px);
    nearest_.assign(pixels, -std::numeric_limits<double>::max());
    slant_.assign(pixels, 0.0);
  }

  void disc(const Vec3d& p, const Vec3d& normal, double radius_m) {
    const Vec3d offset = p - centre_;
    const double half = 0.5 * (size_px_ - 1);
    const double u = half + offset.dot(right_) / pixel_m_;
    const double v = half + offset.dot(down_) / pixel_m_;
    const double height_m = offset.dot(out_);
    const int r = std::max(1, static_cast<int>(std::ceil(radius_m / pixel_m_)));
    const int cu = static_cast<int>(std::floor(u + 0.5));
    const int cv = static_cast<int>(std::floor(v + 0.5));
    for (int y = std::max(0, cv - r); y <= std::min(size_px_ - 1, cv + r); ++y) {
      for (int x = std::max(0, cu - r); x <= std::min(size_px_ - 1, cu + r); ++x) {
        if ((x - cu) * (x - cu) + (y - cv) * (y - cv) > r * r) continue;
        const std::size_t pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(size_px_) +
                                  static_cast<std::size_t>(x);
        if (height_m <= nearest_[pixel]) continue;
        nearest_[pixel] = height_m;
        slant_[pixel] = normal.dot(out_);
      }
    }
  }

  [[nodiscard]] ModelPicture picture() const {
    ModelPicture picture{size_px_, size_px_, {}, 0.0};
    std::size_t drawn = 0;
    std::size_t back = 0;
    for (std::size_t i = 0; i < nearest_.size(); ++i) {
      const bool hit = nearest_[i] > -std::numeric_limits<double>::max();
      drawn += hit ? 1 : 0;
      back += hit && slant_[i] < 0.0 ? 1 : 0;
      picture.pixels.push_back(hit ? shade(slant_[i]) : kBackground);
    }
    if (drawn > 0) picture.open_share = static_cast<double>(back) / static_cast<double>(drawn);
    return picture;
  }

 private:
  static Rgb8 shade(double slant) {
    const double light = 60.0 + 170.0 * std::abs(slant);
    const auto full = static_cast<std::uint8_t>(light);
    const auto low = static_cast<std::uint8_t>(0.45 * light);
    return slant >= 0.0 ? Rgb8{full, full, full} : Rgb8{full, low, low};
  }

  int size_px_;
  double pixel_m_;
  Vec3d centre_;
  Vec3d out_;
  Vec3d right_;
  Vec3d down_;
  std::vector<double> nearest_;
  std::vector<double> slant_;
};

}  // namespace

std::span<const ModelSide> model_sides() noexcept {
  static const std::array<ModelSide, 6> kSides = {{{"-z", -Vec3d::UnitZ()},
                                                   {"+x", Vec3d::UnitX()},
                                                   {"+z", Vec3d::UnitZ()},
                                                   {"-x", -Vec3d::UnitX()},
                                                   {"-y", -Vec3d::UnitY()},
                                                   {"+y", Vec3d::UnitY()}}};
  return kSides;
}

ModelPicture draw_model(const CloudData& cloud, double voxel_m, const Vec3d& centre,
                        double radius_m, const Vec3d& toward_viewer, int size_px) {
  // Discs reach their neighbours' edge over the diagonal of a voxel.
  constexpr double kDisc = 1.0;
  const double pixel_m = 2.1 * std::max(radius_m, 1e-9) / size_px;
  Canvas canvas(size_px, pixel_m, centre, toward_viewer);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    canvas.disc({cloud.x[i], cloud.y[i], cloud.z[i]}, {cloud.nx[i], cloud.ny[i], cloud.nz[i]},
                kDisc * voxel_m);
  }
  return canvas.picture();
}

ModelQuality measure_quality(const CloudData& cloud, double voxel_m,
                             const std::vector<Vec3d>& cameras) {
  const Ball ball = ball_around(cloud);
  ModelQuality quality;
  int near = 0;
  for (int i = 0; i < kDirections; ++i) {
    const Vec3d direction = spiral_direction(i, kDirections);
    near += std::any_of(cameras.begin(), cameras.end(), [&](const Vec3d& camera) {
      return direction.dot((camera - ball.centre).normalized()) >= kCosNear;
    });
  }
  quality.view_sphere_coverage = static_cast<double>(near) / kDirections;
  const auto open_from = [&](const Vec3d& toward_viewer) {
    return draw_model(cloud, voxel_m, ball.centre, ball.radius_m, toward_viewer, kQualitySize_px)
        .open_share;
  };
  for (int i = 0; i < kQualityDirections; ++i) {
    quality.open_share += open_from(spiral_direction(i, kQualityDirections)) / kQualityDirections;
  }
  for (std::size_t i = 0; i < quality.side_open_share.size(); ++i) {
    quality.side_open_share[i] = open_from(model_sides()[i].toward_viewer);
  }
  return quality;
}

ModelPicture draw_sides(const CloudData& cloud, double voxel_m, int size_px) {
  constexpr int kColumns = 3;
  const Ball ball = ball_around(cloud);
  ModelPicture sheet{kColumns * size_px, 2 * size_px, {}, 0.0};
  sheet.pixels.assign(
      static_cast<std::size_t>(sheet.width) * static_cast<std::size_t>(sheet.height), kBackground);
  for (std::size_t side = 0; side < model_sides().size(); ++side) {
    const ModelPicture one = draw_model(cloud, voxel_m, ball.centre, ball.radius_m,
                                        model_sides()[side].toward_viewer, size_px);
    const auto size = static_cast<std::size_t>(size_px);
    for (std::size_t row = 0; row < size; ++row) {
      const std::size_t at =
          (side / kColumns * size + row) * static_cast<std::size_t>(sheet.width) +
          side % kColumns * size;
      std::copy_n(one.pixels.begin() + static_cast<std::ptrdiff_t>(row * size), size,
                  sheet.pixels.begin() + static_cast<std::ptrdiff_t>(at));
    }
  }
  return sheet;
}

}  // namespace grapnel
