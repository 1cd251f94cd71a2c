#include "pipeline/coarse/pose_score.h"

#include <algorithm>

#include "pipeline/kernels/pose_rating.h"
#include "pipeline/refine/point_blocks.h"

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

kernels::OrientedPlanes planes_of(const SampleSet& samples) noexcept {
  return {samples.x.data(),  samples.y.data(),  samples.z.data(),
          samples.nx.data(), samples.ny.data(), samples.nz.data()};
}

double share_on_surface(const SampleSet& samples, const Pose& pose, const ClosestPointTable& table,
                        const Surface& surface, float tolerance_m, std::size_t count) noexcept {
  if (count == 0) return 0.0;
  const kernels::NamedSurface named{table.voxels(),
                                    table.named(),
                                    {surface.x.data(), surface.y.data(), surface.z.data(),
                                     surface.nx.data(), surface.ny.data(), surface.nz.data()}};
  const float sum = kernels::rate_on_surface(planes_of(samples), count, kernels::motion_of(pose),
                                             named, tolerance_m, kCosNormal);
  return static_cast<double>(sum) / static_cast<double>(count);
}

}  // namespace

void SampleSet::reserve(Arena& arena, std::size_t max_samples) {
  for (std::span<float>* plane : {&x, &y, &z, &nx, &ny, &nz}) {
    *plane = arena.take<float>(kernels::in_lanes(max_samples));
  }
  capacity_ = max_samples;
}

void SampleSet::draw(const Surface& surface, Rng rng) noexcept {
  size = std::min(capacity_, surface.size);
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
  const kernels::SightLaw law{tolerance_m_, kCosFacing, kNoReading, kHidden, kSeenThrough};
  const kernels::Sight sight =
      kernels::rate_sight(planes_of(*model_.samples), std::min(max_samples, model_.samples->size),
                          kernels::motion_of(pose), scene_.sight->pixels(), law);
  return sight.facing > 0.0F ? static_cast<double>(sight.worth / sight.facing) : -1.0;
}

double PoseScore::met_share(const Pose& pose, std::size_t max_samples) const noexcept {
  return share_on_surface(*model_.samples, pose, *scene_.table, *scene_.surface, tolerance_m_,
                          std::min(max_samples, model_.samples->size));
}

double PoseScore::explained_share(const Pose& pose, std::size_t max_samples) const noexcept {
  return share_on_surface(*scene_.samples, pose.inverse(), *model_.table, *model_.surface,
                          tolerance_m_, std::min(max_samples, scene_.samples->size));
}

Pose PoseScore::slid(const Pose& target_from_source, std::size_t max_samples) const noexcept {
  const SampleSet& samples = *scene_.samples;
  const std::size_t count = std::min(max_samples, samples.size);
  const kernels::Motion inward = kernels::motion_of(target_from_source.inverse());
  kernels::PointBlock block;
  Vec3f way = Vec3f::Zero();
  float found = 0.0F;
  for (std::size_t first = 0; first < count;) {
    first = take_block(planes_of(samples), count, first, 1, block);
    kernels::move_block(inward, block);
    model_.table->nearby_of_each(block.x, block.y, block.z, block.size, 0.0F, block.partner);
    for (std::size_t k = 0; k < block.size; ++k) {
      if (block.partner[k] < 0) continue;
      const Vec3f p(block.x[k], block.y[k], block.z[k]);
      way += p - model_.surface->point(static_cast<std::size_t>(block.partner[k]));
      found += 1.0F;
    }
  }
  Pose result = target_from_source;
  if (found > 0.0F) {
    result.translation() += target_from_source.linear() * (way / found).cast<double>();
  }
  return result;
}

double PoseScore::near_share(const Pose& pose, std::size_t max_samples) const noexcept {
  const SampleSet& samples = *scene_.samples;
  const std::size_t count = std::min(max_samples, samples.size);
  if (count == 0) return 0.0;
  const float sum = kernels::rate_in_field(
      planes_of(samples), count, kernels::motion_of(pose.inverse()), model_.field->levels());
  return static_cast<double>(sum) / static_cast<double>(count);
}

double PoseScore::glance(const Pose& target_from_source, std::size_t max_samples,
                         double at_least) const noexcept {
  const double explained = model_.field != nullptr
                               ? near_share(target_from_source, max_samples)
                               : explained_share(target_from_source, max_samples);
  if (explained + 1.0 <= at_least) return explained - 1.0;
  return explained + (scene_.sight != nullptr ? seen_share(target_from_source, max_samples)
                                              : met_share(target_from_source, max_samples));
}

double PoseScore::operator()(const Pose& target_from_source,
                             std::size_t max_samples) const noexcept {
  return explained_share(target_from_source, max_samples) +
         (scene_.sight != nullptr ? seen_share(target_from_source, max_samples)
                                  : met_share(target_from_source, max_samples));
}

}  // namespace grapnel
