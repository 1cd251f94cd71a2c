#include "pipeline/coarse/pose_score.h"

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

// Weights of the ways in which a predicted point is not met. Seeing through a surface speaks
// against a pose, something in front of it hardly does.
constexpr float kSeenThrough = 2.0F;
constexpr float kHidden = 0.4F;
constexpr float kNoReading = 0.3F;
// Normals of partners differ by less than 45 degrees.
constexpr float kCosNormal = 0.7F;
constexpr float kCosFacing = 0.17F;

/// 1 at no distance, 0 at the tolerance.
float closeness(float distance_m, float tolerance_m) noexcept {
  const float ratio = distance_m / tolerance_m;
  return std::max(0.0F, 1.0F - ratio * ratio);
}

double share_on_surface(const SampleSet& samples, const Eigen::Matrix3f& rotation,
                        const Vec3f& shift, const ClosestPointTable& table, const Surface& surface,
                        float tolerance_m, std::size_t count) noexcept {
  float sum = 0.0F;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3f p = rotation * Vec3f(samples.x[i], samples.y[i], samples.z[i]) + shift;
    const std::int32_t found = table.nearby(p);
    if (found < 0) continue;
    const auto partner = static_cast<std::size_t>(found);
    const float distance = (surface.point(partner) - p).norm();
    if (distance >= tolerance_m) continue;
    const Vec3f normal = rotation * Vec3f(samples.nx[i], samples.ny[i], samples.nz[i]);
    if (normal.squaredNorm() > 0.5F && normal.dot(surface.normal(partner)) < kCosNormal) continue;
    sum += closeness(distance, tolerance_m);
  }
  return count == 0 ? 0.0 : static_cast<double>(sum) / static_cast<double>(count);
}

}  // namespace

void SampleSet::reserve(Arena& arena, std::size_t max_samples) {
  for (std::span<float>* plane : {&x, &y, &z, &nx, &ny, &nz}) {
    *plane = arena.take<float>(max_samples);
  }
}

void SampleSet::draw(const Surface& surface, Rng rng) noexcept {
  size = std::min(x.size(), surface.size);
  for (std::size_t k = 0; k < size; ++k) {
    // One of each of `size` equal stretches, the stretches visited in a scattered order.
    const std::size_t stretch = (k * 2654435761U) % size;
    const std::size_t begin = stretch * surface.size / size;
    const std::size_t end = (stretch + 1) * surface.size / size;
    const std::size_t i = begin + rng.below(static_cast<std::uint32_t>(end - begin));
    x[k] = surface.x[i];
    y[k] = surface.y[i];
    z[k] = surface.z[i];
    nx[k] = surface.nx[i];
    ny[k] = surface.ny[i];
    nz[k] = surface.nz[i];
  }
}

double PoseScore::seen_share(const Pose& pose, std::size_t max_samples) const noexcept {
  const DepthView& view = *scene_.view;
  const SampleSet& samples = *model_.samples;
  const Eigen::Matrix3f rotation = pose.linear().cast<float>();
  const Vec3f shift = pose.translation().cast<float>();
  const auto fx = static_cast<float>(view.intrinsics.fx);
  const auto fy = static_cast<float>(view.intrinsics.fy);
  const auto cx = static_cast<float>(view.intrinsics.cx) + 0.5F;
  const auto cy = static_cast<float>(view.intrinsics.cy) + 0.5F;
  const auto width = static_cast<float>(view.depth.width);
  const auto height = static_cast<float>(view.depth.height);
  float facing = 0.0F;
  float worth = 0.0F;
  const std::size_t count = std::min(max_samples, samples.size);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3f p = rotation * Vec3f(samples.x[i], samples.y[i], samples.z[i]) + shift;
    const Vec3f normal = rotation * Vec3f(samples.nx[i], samples.ny[i], samples.nz[i]);
    const float toward = -normal.dot(p);
    if (toward <= 0.0F || p.z() <= 0.0F) continue;
    const float range_square = p.squaredNorm();
    if (toward * toward < kCosFacing * kCosFacing * range_square) continue;
    const float cosine = toward / std::sqrt(range_square);
    facing += cosine;
    const float u = fx * p.x() / p.z() + cx;
    const float v = fy * p.y() / p.z() + cy;
    if (!(u >= 0.0F && v >= 0.0F && u < width && v < height)) {
      worth -= kNoReading * cosine;
      continue;
    }
    const int pixel_u = static_cast<int>(u);
    const int pixel_v = static_cast<int>(v);
    const float z = view.z_m(pixel_u, pixel_v);
    if (!(z > 0.0F)) {
      worth -= kNoReading * cosine;
      continue;
    }
    // Distance of the measured point from the sample's tangent plane, positive behind it.
    const float off = (z - p.z()) * cosine;
    const bool foreground = !view.background(pixel_u, pixel_v);
    if (std::fabs(off) < tolerance_m_) {
      if (foreground) worth += cosine * closeness(off, tolerance_m_);
    } else {
      worth -= cosine * (off > 0.0F ? kSeenThrough : kHidden);
    }
  }
  return facing > 0.0F ? static_cast<double>(worth / facing) : -1.0;
}

double PoseScore::met_share(const Pose& pose, std::size_t max_samples) const noexcept {
  return share_on_surface(*model_.samples, pose.linear().cast<float>(),
                          pose.translation().cast<float>(), *scene_.table, *scene_.surface,
                          tolerance_m_, std::min(max_samples, model_.samples->size));
}

double PoseScore::explained_share(const Pose& pose, std::size_t max_samples) const noexcept {
  const Pose inverse = pose.inverse();
  return share_on_surface(*scene_.samples, inverse.linear().cast<float>(),
                          inverse.translation().cast<float>(), *model_.table, *model_.surface,
                          tolerance_m_, std::min(max_samples, scene_.samples->size));
}

Pose PoseScore::slid(const Pose& target_from_source, std::size_t max_samples) const noexcept {
  const Pose inverse = target_from_source.inverse();
  const Eigen::Matrix3f rotation = inverse.linear().cast<float>();
  const Vec3f shift = inverse.translation().cast<float>();
  const SampleSet& samples = *scene_.samples;
  Vec3f way = Vec3f::Zero();
  float count = 0.0F;
  for (std::size_t i = 0; i < std::min(max_samples, samples.size); ++i) {
    const Vec3f p = rotation * Vec3f(samples.x[i], samples.y[i], samples.z[i]) + shift;
    const std::int32_t found = model_.table->nearby(p);
    if (found < 0) continue;
    way += p - model_.surface->point(static_cast<std::size_t>(found));
    count += 1.0F;
  }
  Pose result = target_from_source;
  if (count > 0.0F) {
    result.translation() += target_from_source.linear() * (way / count).cast<double>();
  }
  return result;
}

double PoseScore::near_share(const Pose& pose, std::size_t max_samples) const noexcept {
  const Pose inverse = pose.inverse();
  const Eigen::Matrix3f rotation = inverse.linear().cast<float>();
  const Vec3f shift = inverse.translation().cast<float>();
  const SampleSet& samples = *scene_.samples;
  const std::size_t count = std::min(max_samples, samples.size);
  float sum = 0.0F;
  for (std::size_t i = 0; i < count; ++i) {
    sum +=
        model_.field->closeness(rotation * Vec3f(samples.x[i], samples.y[i], samples.z[i]) + shift);
  }
  return count == 0 ? 0.0 : static_cast<double>(sum) / static_cast<double>(count);
}

double PoseScore::glance(const Pose& target_from_source, std::size_t max_samples,
                         double at_least) const noexcept {
  const double explained = model_.field != nullptr
                               ? near_share(target_from_source, max_samples)
                               : explained_share(target_from_source, max_samples);
  if (explained + 1.0 <= at_least) return explained - 1.0;
  return explained + (scene_.view != nullptr ? seen_share(target_from_source, max_samples)
                                             : met_share(target_from_source, max_samples));
}

double PoseScore::operator()(const Pose& target_from_source,
                             std::size_t max_samples) const noexcept {
  return explained_share(target_from_source, max_samples) +
         (scene_.view != nullptr ? seen_share(target_from_source, max_samples)
                                 : met_share(target_from_source, max_samples));
}

}  // namespace grapnel
