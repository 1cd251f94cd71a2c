#include "pipeline/pair_views.h"

#include <algorithm>
#include <array>
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
constexpr double kAcross = 3.0;
constexpr std::size_t kMostStride = 4;

/// In blocks without a way out, which the compiler makes vectors of.
bool any(const std::span<float>& plane, std::size_t size) noexcept {
  constexpr std::size_t kAtOnce = 1024;
  for (std::size_t begin = 0; begin < size; begin += kAtOnce) {
    int set = 0;
    for (const float value : plane.subspan(begin, std::min(kAtOnce, size - begin))) {
      set |= value != 0.0F ? 1 : 0;
    }
    if (set != 0) return true;
  }
  return false;
}

/// Readings that become points.
struct Block {
  std::array<std::size_t, kMostStride * kMostStride> reading;
  std::size_t size = 0;
};

/// The mean of those readings that are as far away as the first one, and the others as they are:
/// of the coordinates, and of what else the surface has.
void append_block(const Surface& from, float same_m, bool attributes, Block& block,
                  Surface& to) noexcept {
  Block others;
  const float first_m = from.z[block.reading[0]];
  std::size_t alike = 0;
  Vec3f sum = Vec3f::Zero();
  for (std::size_t k = 0; k < block.size; ++k) {
    const std::size_t i = block.reading[k];
    if (std::fabs(from.z[i] - first_m) > same_m) {
      others.reading[others.size++] = i;
      continue;
    }
    sum += from.point(i);
    block.reading[alike++] = i;
  }
  const float per_reading = 1.0F / static_cast<float>(alike);
  to.x[to.size] = sum.x() * per_reading;
  to.y[to.size] = sum.y() * per_reading;
  to.z[to.size] = sum.z() * per_reading;
  for (std::size_t k = 0; k < others.size; ++k) {
    to.x[to.size + 1 + k] = from.x[others.reading[k]];
    to.y[to.size + 1 + k] = from.y[others.reading[k]];
    to.z[to.size + 1 + k] = from.z[others.reading[k]];
  }
  const auto append = [&](const std::span<float>& plane, const std::span<float>& out) {
    float total = 0.0F;
    for (std::size_t k = 0; k < alike; ++k) total += plane[block.reading[k]];
    out[to.size] = total * per_reading;
    for (std::size_t k = 0; k < others.size; ++k) out[to.size + 1 + k] = plane[others.reading[k]];
  };
  if (attributes) {
    append(from.nx, to.nx);
    append(from.ny, to.ny);
    append(from.nz, to.nz);
    append(from.intensity, to.intensity);
  }
  to.size += 1 + others.size;
}

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
      std::clamp(leaf_m / (kAcross * pitch_m), 1.0, static_cast<double>(kMostStride)));
}

bool copy_blocks(const Surface& from, int stride, double leaf_m, Surface& to) noexcept {
  to.clear();
  const auto step = static_cast<std::size_t>(stride);
  const auto width = static_cast<std::size_t>(from.grid.width);
  const auto height = static_cast<std::size_t>(from.grid.height);
  const auto same_m = static_cast<float>(leaf_m);
  const bool attributes = any_normal(from) || any(from.intensity, from.size);
  Block block;
  for (std::size_t v = 0; v < height; v += step) {
    for (std::size_t u = 0; u < width; u += step) {
      block.size = 0;
      const std::size_t end = std::min(u + step, width);
      for (std::size_t row = v; row < std::min(v + step, height); ++row) {
        for (std::size_t pixel = row * width + u; pixel < row * width + end; ++pixel) {
          const std::int32_t point = from.grid.point_of[pixel];
          if (point >= 0) block.reading[block.size++] = static_cast<std::size_t>(point);
        }
      }
      if (block.size == 0) continue;
      if (to.size + block.size > to.capacity()) return false;
      append_block(from, same_m, attributes, block, to);
    }
  }
  if (!attributes) {
    for (const std::span<float>& plane : {to.nx, to.ny, to.nz, to.intensity}) {
      std::fill_n(plane.begin(), to.size, 0.0F);
    }
  }
  to.viewpoint = from.viewpoint;
  to.has_viewpoint = from.has_viewpoint;
  to.spacing_m = stride * from.spacing_m;
  return true;
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

bool any_normal(const Surface& surface) noexcept {
  return any(surface.nx, surface.size) || any(surface.ny, surface.size) ||
         any(surface.nz, surface.size);
}

}  // namespace grapnel
