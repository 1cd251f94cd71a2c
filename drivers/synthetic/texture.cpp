#include "drivers/synthetic/texture.h"

#include <algorithm>
#include <cmath>

#include "base/rng.h"

namespace grapnel {
namespace {

constexpr float kAmbient = 0.3f;
constexpr double kBeltCell_m = 0.015;

/// Even in 0…1 per cell of a grid, in eighths so that pictures compress.
float cell_value(std::int64_t x, std::int64_t y, std::int64_t z, std::uint64_t variant) {
  const std::uint64_t key = static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15ULL +
                            static_cast<std::uint64_t>(y) * 0xc2b2ae3d27d4eb4fULL +
                            static_cast<std::uint64_t>(z) * 0x165667b19e3779f9ULL + variant;
  return static_cast<float>(Rng::mix(key) >> 61) / 7.0f;
}

std::int64_t cell(double value_m, double size_m) {
  // Rounded toward minus infinity for all that lies within a thousand million cells.
  constexpr std::int64_t kShift = 1'000'000'000;
  return static_cast<std::int64_t>(value_m / size_m + static_cast<double>(kShift)) - kShift;
}

std::uint8_t channel(float value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0f, 255.0f));
}

}  // namespace

float light_on(const Vec3f& normal_camera) {
  // From the upper left of the camera, length 1 (2/7, 3/7, 6/7).
  const Vec3f to_light(-2.0f / 7.0f, -3.0f / 7.0f, -6.0f / 7.0f);
  return kAmbient + (1.0f - kAmbient) * std::max(0.0f, normal_camera.dot(to_light));
}

Texture::Texture(PartKind kind, double albedo, std::uint64_t variant)
    : kind_(kind), variant_(variant) {
  Vec3f base(200.0f, 160.0f, 110.0f);  // cardboard
  if (kind == PartKind::Barrel) base = {50.0f, 90.0f, 190.0f};
  if (kind == PartKind::Sack) base = {225.0f, 215.0f, 190.0f};
  if (kind == PartKind::Mesh) base = {150.0f, 170.0f, 150.0f};
  // 0.6 is the albedo of the plain materials above.
  const auto scale = static_cast<float>(std::min(1.25, albedo / 0.6));
  base_ = base * scale;
}

Rgb8 Texture::color_at(const Vec3d& point, const Vec3f& normal_camera) const {
  const double cell_m = kind_ == PartKind::Sack ? 0.008 : 0.02;
  float shade = 0.88f + 0.12f * cell_value(cell(point.x(), cell_m), cell(point.y(), cell_m),
                                           cell(point.z(), cell_m), variant_);
  float tint_r = 1.0f;
  if (kind_ == PartKind::Box || kind_ == PartKind::Carton) {
    if (std::fabs(point.y()) < 0.025) shade *= 1.15f;  // tape
    const bool label = point.x() > 0.05 && point.x() < 0.14 && point.y() > 0.04;
    if (label) shade *= 0.45f + 0.4f * cell_value(cell(point.x(), 0.01), 0, 0, variant_);
  } else if (kind_ == PartKind::Barrel) {
    if (std::fabs(point.z()) < 0.03) tint_r = 3.5f;  // band round the drum
  }
  const float lit = shade * light_on(normal_camera);
  return {channel(base_.x() * tint_r * lit), channel(base_.y() * lit), channel(base_.z() * lit)};
}

Rgb8 belt_color(double along_m, double across_m, float light) {
  const float weave = cell_value(cell(along_m, kBeltCell_m), cell(across_m, kBeltCell_m), 0, 0);
  const float value = (48.0f + 16.0f * weave) * light;
  return {channel(value), channel(value * 1.02f), channel(value * 1.06f)};
}

}  // namespace grapnel
