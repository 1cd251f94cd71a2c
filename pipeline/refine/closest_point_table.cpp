#include "pipeline/refine/closest_point_table.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/assert.h"
#include "pipeline/kernels/spread_claims.h"
#include "pipeline/kernels/surface_pairs.h"

namespace grapnel {
namespace {

constexpr int kMaxSide = 512;
constexpr std::uint16_t kNoPoint = 0xffffU;
constexpr float kFar = 1e9F;

/// Cube root by Newton's method: the C library's differs between machines. x > 0.
double cube_root(double x) noexcept {
  double root = x < 1.0 ? 1.0 : x;
  for (int i = 0; i < 200; ++i) root = (2.0 * root + x / (root * root)) / 3.0;
  return root;
}

/// One line of the distance transform: lower envelope of parabolas, equation 2 of the paper.
void transform_line(int count, const float* in, const std::uint16_t* in_index, float* out,
                    std::uint16_t* out_index) noexcept {
  std::array<int, kMaxSide> apex;
  std::array<float, kMaxSide + 1> bound;
  int last = -1;
  for (int q = 0; q < count; ++q) {
    if (in[q] >= kFar) continue;
    float cross = -std::numeric_limits<float>::infinity();
    while (last >= 0) {
      const int p = apex[static_cast<std::size_t>(last)];
      const float rise = in[q] + static_cast<float>(q * q) - in[p] - static_cast<float>(p * p);
      cross = rise / static_cast<float>(2 * (q - p));
      if (cross > bound[static_cast<std::size_t>(last)]) break;
      --last;
    }
    if (last < 0) cross = -std::numeric_limits<float>::infinity();
    ++last;
    apex[static_cast<std::size_t>(last)] = q;
    bound[static_cast<std::size_t>(last)] = cross;
  }
  if (last < 0) {
    std::fill(out, out + count, kFar);
    std::fill(out_index, out_index + count, kNoPoint);
    return;
  }
  const auto parabolas = static_cast<std::size_t>(last) + 1;
  std::size_t k = 0;
  for (int q = 0; q < count; ++q) {
    while (k + 1 < parabolas && bound[k + 1] < static_cast<float>(q)) ++k;
    const int p = apex[k];
    out[q] = static_cast<float>((q - p) * (q - p)) + in[p];
    out_index[q] = in_index[p];
  }
}

}  // namespace

void ClosestPointTable::reserve(Arena& arena, std::size_t max_voxels) {
  nearest_ = arena.take<std::uint16_t>(max_voxels);
  work_ = arena.take<std::uint32_t>(max_voxels + kernels::kClaimSlack);
}

void ClosestPointTable::shape(const Surface& surface, double margin_m,
                              double least_voxel_m) noexcept {
  Vec3d low = Vec3d::Constant(std::numeric_limits<double>::max());
  Vec3d high = -low;
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Vec3d p = surface.point(i).cast<double>();
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  low.array() -= margin_m;
  high.array() += margin_m;
  const Vec3d extent = (high - low).cwiseMax(1e-9);
  voxel_m_ = std::max({cube_root(extent.prod() / static_cast<double>(nearest_.size())),
                       extent.maxCoeff() / (kMaxSide - 2), least_voxel_m});
  for (;;) {
    std::size_t voxels = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const int side = static_cast<int>(extent[axis] / voxel_m_) + 1;
      size_[static_cast<std::size_t>(axis)] = side;
      voxels *= static_cast<std::size_t>(side);
    }
    if (voxels <= nearest_.size()) break;
    voxel_m_ *= 1.02;
  }
  origin_ = low.cast<float>();
  per_metre_ = static_cast<float>(1.0 / voxel_m_);
}

std::size_t ClosestPointTable::voxel_count() const noexcept {
  return static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) *
         static_cast<std::size_t>(size_[2]);
}

template <class Claim>
void ClosestPointTable::for_seeds(const Claim& claim) noexcept {
  for (std::size_t i = 0; i < surface_->size; ++i) {
    const Vec3f place = (surface_->point(i) - origin_) * per_metre_;
    const int x = std::clamp(static_cast<int>(place.x()), 0, size_[0] - 1);
    const int y = std::clamp(static_cast<int>(place.y()), 0, size_[1] - 1);
    const int z = std::clamp(static_cast<int>(place.z()), 0, size_[2] - 1);
    const Vec3f centre(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F,
                       static_cast<float>(z) + 0.5F);
    const auto voxel = static_cast<std::size_t>((z * size_[1] + y) * size_[0] + x);
    claim(i, voxel, (place - centre).squaredNorm());
  }
}

void ClosestPointTable::seed() noexcept {
  std::fill_n(nearest_.begin(), voxel_count(), kNoPoint);
  std::fill_n(work_.begin(), voxel_count(), std::bit_cast<std::uint32_t>(kFar));
  for_seeds([&](std::size_t i, std::size_t voxel, float square) {
    if (square >= std::bit_cast<float>(work_[voxel])) return;
    work_[voxel] = std::bit_cast<std::uint32_t>(square);
    nearest_[voxel] = static_cast<std::uint16_t>(i);
  });
}

void ClosestPointTable::sweep(int axis) noexcept {
  const std::array<std::size_t, 3> step = {
      1, static_cast<std::size_t>(size_[0]),
      static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1])};
  const auto a = static_cast<std::size_t>(axis);
  // The inner loop takes the shorter steps: neighbouring lines share what the caches hold.
  const std::size_t b = axis == 2 ? 1 : 2;
  const std::size_t c = axis == 0 ? 1 : 0;
  std::array<float, kMaxSide> in, out;
  std::array<std::uint16_t, kMaxSide> in_index, out_index;
  const auto count = static_cast<std::size_t>(size_[a]);
  for (std::size_t i = 0; i < static_cast<std::size_t>(size_[b]); ++i) {
    for (std::size_t j = 0; j < static_cast<std::size_t>(size_[c]); ++j) {
      const std::size_t first = i * step[b] + j * step[c];
      for (std::size_t k = 0; k < count; ++k) {
        in[k] = std::bit_cast<float>(work_[first + k * step[a]]);
        in_index[k] = nearest_[first + k * step[a]];
      }
      transform_line(size_[a], in.data(), in_index.data(), out.data(), out_index.data());
      for (std::size_t k = 0; k < count; ++k) {
        work_[first + k * step[a]] = std::bit_cast<std::uint32_t>(out[k]);
        nearest_[first + k * step[a]] = out_index[k];
      }
    }
  }
}

void ClosestPointTable::build(const Surface& surface, double margin_m) noexcept {
  GRAPNEL_ASSERT(surface.size > 0 && surface.size < kNoPoint);
  surface_ = &surface;
  shape(surface, margin_m, 0.0);
  seed();
  for (int axis = 0; axis < 3; ++axis) sweep(axis);
}

void ClosestPointTable::build_within(const Surface& surface, double reach_m) noexcept {
  GRAPNEL_ASSERT(surface.size > 0 && surface.size < kNoPoint);
  surface_ = &surface;
  // A voxel's centre and its seed lie off what is looked up: by a voxel and a bit.
  shape(surface, reach_m, reach_m / (kernels::kMaxClaimReach - 2));
  std::fill_n(work_.begin(), voxel_count(), kernels::kUnclaimed);
  for_seeds([&](std::size_t i, std::size_t voxel, float square) {
    const auto claim =
        static_cast<kernels::Claim>(square * 16.0F + 0.5F) << 16 | static_cast<kernels::Claim>(i);
    work_[voxel] = std::min(work_[voxel], claim);
  });
  const int reach = std::min(static_cast<int>(reach_m / voxel_m_) + 2, kernels::kMaxClaimReach);
  const std::int32_t size[3] = {size_[0], size_[1], size_[2]};
  for (int axis = 0; axis < 3; ++axis) kernels::spread_claims(axis, size, reach, work_.data());
  const std::size_t voxels = voxel_count();
  for (std::size_t voxel = 0; voxel < voxels; ++voxel) {
    nearest_[voxel] = static_cast<std::uint16_t>(work_[voxel]);
  }
}

std::int32_t ClosestPointTable::nearby(const Vec3f& p) const noexcept {
  const Vec3f place = (p - origin_) * per_metre_;
  if (!(place.x() >= 0.0F && place.y() >= 0.0F && place.z() >= 0.0F)) return -1;
  if (place.x() >= static_cast<float>(size_[0]) || place.y() >= static_cast<float>(size_[1]) ||
      place.z() >= static_cast<float>(size_[2])) {
    return -1;
  }
  const int x = static_cast<int>(place.x());
  const int y = static_cast<int>(place.y());
  const int z = static_cast<int>(place.z());
  return nearest_[static_cast<std::size_t>((z * size_[1] + y) * size_[0] + x)];
}

kernels::VoxelShape ClosestPointTable::voxels() const noexcept {
  return {{origin_.x(), origin_.y(), origin_.z()}, per_metre_, {size_[0], size_[1], size_[2]}};
}

void ClosestPointTable::nearby_of_each(const float* x, const float* y, const float* z,
                                       std::size_t count, float /*max_distance_m*/,
                                       std::int32_t* found) const noexcept {
  kernels::find_voxels(voxels(), x, y, z, count, found);
  for (std::size_t i = 0; i < count; ++i) {
    if (found[i] >= 0) found[i] = nearest_[static_cast<std::size_t>(found[i])];
  }
}

void ClosestPointTable::closest_of_each(const float* x, const float* y, const float* z,
                                        std::size_t count, float max_distance_m,
                                        std::int32_t* found) const noexcept {
  const kernels::NamedPoints points{voxels(), named(), surface_->x.data(), surface_->y.data(),
                                    surface_->z.data()};
  kernels::find_nearest_named(points, x, y, z, count, max_distance_m, found);
}

std::int32_t ClosestPointTable::closest(const Vec3f& p, float max_distance_m) const noexcept {
  const Vec3f place = (p - origin_) * per_metre_;
  if (!(place.x() >= 0.0F && place.y() >= 0.0F && place.z() >= 0.0F)) return -1;
  if (place.x() >= static_cast<float>(size_[0]) || place.y() >= static_cast<float>(size_[1]) ||
      place.z() >= static_cast<float>(size_[2])) {
    return -1;
  }
  // The voxel of p and, on each axis, its neighbour on the side p lies toward.
  std::array<std::array<int, 2>, 3> cell;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const int own = static_cast<int>(place[axis]);
    const int toward = place[axis] - static_cast<float>(own) < 0.5F ? own - 1 : own + 1;
    cell[a] = {own, std::clamp(toward, 0, size_[a] - 1)};
  }
  std::int32_t best = -1;
  float best_square = max_distance_m * max_distance_m;
  for (const int z : cell[2]) {
    for (const int y : cell[1]) {
      for (const int x : cell[0]) {
        const std::int32_t candidate =
            nearest_[static_cast<std::size_t>((z * size_[1] + y) * size_[0] + x)];
        if (candidate == best) continue;
        const Vec3f gap = surface_->point(static_cast<std::size_t>(candidate)) - p;
        // Added in the kernel's order.
        const float square = gap.x() * gap.x() + gap.y() * gap.y() + gap.z() * gap.z();
        if (square <= best_square) {
          best_square = square;
          best = candidate;
        }
      }
    }
  }
  return best;
}

}  // namespace grapnel
