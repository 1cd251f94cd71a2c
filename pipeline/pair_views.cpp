#include "pipeline/pair_views.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

#include "base/assert.h"
#include "base/hash.h"

namespace grapnel {
namespace {

// A view's middle and size are measured by at most twice as many of its points.
constexpr std::size_t kMeasured = 20000;
// Blocks of pixels, of which so many lie across a fine cell, stand for their readings.
constexpr double kAcross = 2.0;

}  // namespace

void ViewIndex::reserve(Arena& arena, const Limits& limits, std::size_t dimension,
                        std::size_t max_fine, std::size_t max_voxels, std::size_t max_samples) {
  fine.reserve(arena, max_fine, 0);
  coarse.reserve(arena, limits.max_points, 0);
  table.reserve(arena, max_voxels);
  samples.reserve(arena, max_samples);
  keypoints = KeypointSet(arena.take<Keypoint>(limits.max_keypoints));
  features.reserve(arena, limits.max_keypoints, dimension);
}

std::uint64_t hash_of(const Surface& surface, std::uint64_t seed) noexcept {
  for (const std::span<float>& plane : {surface.x, surface.y, surface.z}) {
    seed = hash_bytes(std::as_bytes(plane.first(surface.size)), seed);
  }
  return seed;
}

bool copy_points(const Surface& from, Surface& to) noexcept {
  if (from.size > to.capacity()) return false;
  to.clear();
  to.size = from.size;
  std::copy_n(from.x.begin(), from.size, to.x.begin());
  std::copy_n(from.y.begin(), from.size, to.y.begin());
  std::copy_n(from.z.begin(), from.size, to.z.begin());
  std::copy_n(from.nx.begin(), from.size, to.nx.begin());
  std::copy_n(from.ny.begin(), from.size, to.ny.begin());
  std::copy_n(from.nz.begin(), from.size, to.nz.begin());
  std::copy_n(from.intensity.begin(), from.size, to.intensity.begin());
  to.viewpoint = from.viewpoint;
  to.has_viewpoint = from.has_viewpoint;
  to.spacing_m = from.spacing_m;
  return true;
}

void measure(const Surface& raw, ViewIndex& view) noexcept {
  const std::size_t step = raw.size / kMeasured + 1;
  const Vec3d origin = raw.point(0).cast<double>();
  Vec3d sum = Vec3d::Zero();
  double square = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < raw.size; i += step) {
    const Vec3d off = raw.point(i).cast<double>() - origin;
    sum += off;
    square += off.squaredNorm();
    count += 1.0;
  }
  const Vec3d mean = sum / count;
  view.centre = origin + mean;
  view.size_m = 3.0 * std::sqrt(std::max(0.0, square / count - mean.squaredNorm()));
}

int stride_for(const Surface& raw, const Vec3d& centre, double leaf_m) noexcept {
  const Intrinsics& camera = raw.grid.intrinsics;
  if (!raw.organised() || !camera.valid() || !raw.has_viewpoint) return 1;
  const double pitch_m = (centre - raw.viewpoint.cast<double>()).norm() / camera.fx;
  return static_cast<int>(
      std::clamp(leaf_m / (kAcross * pitch_m), 1.0, static_cast<double>(ViewGrid::kMaxStride)));
}

Surface every_nth(const Surface& surface, std::size_t n, std::size_t begin,
                  const Surface& memory) noexcept {
  Surface part = surface;
  part.grid = {};
  part.size = (surface.size + n - 1) / n;
  GRAPNEL_ASSERT(begin + part.size <= memory.capacity());
  const auto thin = [&](const std::span<float>& from, const std::span<float>& room) {
    const std::span<float> to = room.subspan(begin, part.size);
    for (std::size_t i = 0; i < part.size; ++i) to[i] = from[n * i];
    return to;
  };
  part.x = thin(surface.x, memory.x);
  part.y = thin(surface.y, memory.y);
  part.z = thin(surface.z, memory.z);
  part.nx = thin(surface.nx, memory.nx);
  part.ny = thin(surface.ny, memory.ny);
  part.nz = thin(surface.nz, memory.nz);
  return part;
}

/// In blocks without a way out, which the compiler makes vectors of.
bool any_set(const std::span<float>& plane, std::size_t size) noexcept {
  constexpr std::size_t kAtOnce = 1024;
  constexpr std::uint32_t kButSign = 0x7fffffffU;
  for (std::size_t begin = 0; begin < size; begin += kAtOnce) {
    std::uint32_t bits = 0;
    for (const float value : plane.subspan(begin, std::min(kAtOnce, size - begin))) {
      bits |= std::bit_cast<std::uint32_t>(value);
    }
    if ((bits & kButSign) != 0) return true;
  }
  return false;
}

bool any_normal(const Surface& surface) noexcept {
  return any_set(surface.nx, surface.size) || any_set(surface.ny, surface.size) ||
         any_set(surface.nz, surface.size);
}

}  // namespace grapnel
