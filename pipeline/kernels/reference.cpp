#include "pipeline/kernels/reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>

namespace grapnel::kernels::reference {

std::size_t select_within(const PointPlanes& points, std::span<const PointRange> ranges,
                          const Sphere& sphere, std::int32_t* position,
                          float* squared_m2) noexcept {
  std::size_t found = 0;
  for (const PointRange& range : ranges) {
    for (std::int32_t i = range.begin; i < range.end; ++i) {
      const float dx = points.x[i] - sphere.x;
      const float dy = points.y[i] - sphere.y;
      const float dz = points.z[i] - sphere.z;
      const float squared = (dx * dx + dy * dy) + dz * dz;
      if (squared > sphere.squared_m2) continue;
      position[found] = i;
      squared_m2[found++] = squared;
    }
  }
  return found;
}

void add_sphere_moments(const PointPlanes& points, std::span<const PointRange> ranges,
                        const Sphere& sphere, PartialMoments& partial) noexcept {
  for (const PointRange& range : ranges) {
    for (std::int32_t i = range.begin; i < range.end; ++i) {
      const float dx = points.x[i] - sphere.x;
      const float dy = points.y[i] - sphere.y;
      const float dz = points.z[i] - sphere.z;
      if ((dx * dx + dy * dy) + dz * dz > sphere.squared_m2) continue;
      const std::array<float, kMoments> terms = {1.0F,    dx,      dy,      dz,      dx * dx,
                                                 dx * dy, dx * dz, dy * dy, dy * dz, dz * dz};
      const std::int32_t lane = (i - range.begin) % kPartials;
      for (std::size_t moment = 0; moment < terms.size(); ++moment) {
        partial.sum[moment][lane] += terms[moment];
      }
    }
  }
}

void median_row(const std::uint16_t* const* rows, int window, std::size_t width,
                std::uint16_t* out) noexcept {
  const auto side = static_cast<std::size_t>(window);
  for (std::size_t u = 0; u < width; ++u) {
    std::array<std::uint16_t, 25> readings{};
    std::size_t count = 0;
    for (std::size_t i = 0; i < side * side; ++i) {
      const std::uint16_t reading = rows[i / side][u + i % side];
      if (reading != 0) readings[count++] = reading;
    }
    std::sort(readings.begin(), readings.begin() + static_cast<std::ptrdiff_t>(count));
    out[u] = rows[side / 2][u + side / 2] == 0 ? std::uint16_t{0} : readings[count / 2];
  }
}

std::size_t support_row(const std::uint16_t* above, const std::uint16_t* row,
                        const std::uint16_t* below, const GapLaw& gap, int min_support,
                        std::size_t width, std::uint16_t* out) noexcept {
  const std::array<const std::uint16_t*, 3> from = {above, row, below};
  std::size_t removed = 0;
  for (std::size_t u = 0; u < width; ++u) {
    const std::uint16_t centre = row[u + 1];
    const auto depth = static_cast<float>(centre);
    const int allowed = static_cast<int>(depth * (gap.linear + gap.quadratic * depth)) + 1;
    int support = 0;
    for (std::size_t i = 0; i < 9; ++i) {
      const std::uint16_t other = from[i / 3][u + i % 3];
      if (i != 4 && other != 0 && std::abs(centre - other) <= allowed) ++support;
    }
    const bool drop = centre != 0 && support < min_support;
    out[u] = drop ? std::uint16_t{0} : centre;
    removed += drop ? 1U : 0U;
  }
  return removed;
}

void back_project_row(const std::uint16_t* depth, const RowCamera& camera, std::size_t width,
                      float* x, float* y, float* z) noexcept {
  for (std::size_t u = 0; u < width; ++u) {
    z[u] = static_cast<float>(depth[u]) * camera.metres_per_unit;
    x[u] = (static_cast<float>(u) - camera.cx) * camera.inverse_fx * z[u];
    y[u] = camera.y_over_z * z[u];
  }
}

namespace {

struct Triple {
  float x = 0.0F, y = 0.0F, z = 0.0F;
};

float dot(const Triple& a, const Triple& b) noexcept { return (a.x * b.x + a.y * b.y) + a.z * b.z; }

Triple cross(const Triple& a, const Triple& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

float arc_tangent(float y, float x) noexcept {
  const float ax = std::fabs(x);
  const float ay = std::fabs(y);
  const float larger = std::max(ax, ay);
  const float t = std::min(ax, ay) / (larger == 0.0F ? 1.0F : larger);
  const float s = t * t;
  float p = -0.01172120F;
  for (const float next : {0.05265332F, -0.11643287F, 0.19354346F, -0.33262347F, 0.99997726F}) {
    p = p * s + next;
  }
  float angle = p * t;
  if (ay > ax) angle = 1.57079633F - angle;
  if (x < 0.0F) angle = 3.14159265F - angle;
  return y < 0.0F ? -angle : angle;
}

std::int32_t bin(float value, float low, float scale, float bins) noexcept {
  return static_cast<std::int32_t>(std::clamp((value - low) * scale, 0.0F, bins - 0.5F));
}

struct Bins {
  std::int32_t f1 = 0, f2 = 0, f3 = 0;
  bool none = true;
};

Bins bins_of_pair(const Triple& p, const Triple& np, const Triple& q, const Triple& nq,
                  float bins) noexcept {
  const Triple line{q.x - p.x, q.y - p.y, q.z - p.z};
  const float length = std::sqrt(dot(line, line));
  const float along_p = dot(np, line);
  const float along_q = dot(nq, line);
  const float cos_normals = dot(np, nq);
  const bool from_q = std::fabs(along_p) < std::fabs(along_q);
  const float along_u = from_q ? -along_q : along_p;
  const float along_target = from_q ? -along_p : along_q;
  const Triple across = cross(line, from_q ? nq : np);
  const float width = std::sqrt(dot(across, across));
  const float volume = dot(across, from_q ? np : nq);
  const float area = length * width;
  if (area == 0.0F) return {};
  const float inverse = 1.0F / area;
  const float f1 = arc_tangent(along_target - along_u * cos_normals, cos_normals * width);
  const float f2 = (from_q ? -volume : volume) * (inverse * length);
  const float f3 = along_u * (inverse * width);
  return {bin(f1, -3.14159265F, bins * 0.159154943F, bins), bin(f2, -1.0F, bins * 0.5F, bins),
          bin(f3, -1.0F, bins * 0.5F, bins), false};
}

}  // namespace

void pair_bins(const float* points, std::int32_t point_i, std::span<const std::int32_t> others,
               std::int32_t* bins) noexcept {
  const auto triple = [&](std::int32_t i, std::size_t first) {
    const float* from = points + static_cast<std::size_t>(i) * kOrientedRow + first;
    return Triple{from[0], from[1], from[2]};
  };
  for (std::size_t i = 0; i < others.size(); ++i) {
    const Bins b = bins_of_pair(triple(point_i, 0), triple(point_i, 3), triple(others[i], 0),
                                triple(others[i], 3), kPairBins);
    bins[i] = b.none ? kNoPair : b.f1 | b.f2 << 8 | b.f3 << 16;
  }
}

void count_pair_cells(const OrientedPlanes& points, std::size_t count, int bins,
                      const PairCellCounts& counts) noexcept {
  const auto place = [&](std::size_t i) { return Triple{points.x[i], points.y[i], points.z[i]}; };
  const auto normal = [&](std::size_t i) {
    return Triple{points.nx[i], points.ny[i], points.nz[i]};
  };
  for (std::size_t i = 1; i < count; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Bins b =
          bins_of_pair(place(i), normal(i), place(j), normal(j), static_cast<float>(bins));
      if (!b.none) ++counts.table[0][b.f1 + bins * (b.f2 + bins * b.f3)];
    }
  }
}

}  // namespace grapnel::kernels::reference
