#include <cmath>

#include "pipeline/kernels/reference.h"

namespace grapnel::kernels::reference {
namespace {

struct Triple {
  float x, y, z;
};

float dot(const Triple& a, const Triple& b) noexcept { return a.x * b.x + a.y * b.y + a.z * b.z; }

Triple minus(const Triple& a, const Triple& b) noexcept {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}

Triple turned(const Motion& m, const Triple& v) noexcept {
  return {dot({m.r[0], m.r[1], m.r[2]}, v), dot({m.r[3], m.r[4], m.r[5]}, v),
          dot({m.r[6], m.r[7], m.r[8]}, v)};
}

Triple moved(const Motion& m, const Triple& v) noexcept {
  const Triple t = turned(m, v);
  return {t.x + m.t[0], t.y + m.t[1], t.z + m.t[2]};
}

Triple place(const OrientedPlanes& planes, std::size_t i) noexcept {
  return {planes.x[i], planes.y[i], planes.z[i]};
}

Triple normal(const OrientedPlanes& planes, std::size_t i) noexcept {
  return {planes.nx[i], planes.ny[i], planes.nz[i]};
}

std::int32_t voxel_of(const VoxelShape& shape, const Triple& p) noexcept {
  const float place[3] = {(p.x - shape.origin[0]) * shape.per_metre,
                          (p.y - shape.origin[1]) * shape.per_metre,
                          (p.z - shape.origin[2]) * shape.per_metre};
  std::int32_t cell[3];
  for (int axis = 0; axis < 3; ++axis) {
    if (!(place[axis] >= 0.0F && place[axis] < static_cast<float>(shape.size[axis]))) return -1;
    cell[axis] = static_cast<std::int32_t>(place[axis]);
  }
  return (cell[2] * shape.size[1] + cell[1]) * shape.size[0] + cell[0];
}

/// One pair of a block; false when it doesn't count.
struct Pair {
  Triple source, target, difference, source_normal, target_normal;
  bool on_surface = false;
  float distance_square = 0.0F;
};
bool load_pair(const PointBlock& block, const OrientedPlanes& fixed, const PairGate& gate,
               std::size_t i, Pair& pair) noexcept {
  if (block.partner[i] < 0) return false;
  const auto partner = static_cast<std::size_t>(block.partner[i]);
  pair.source = {block.x[i], block.y[i], block.z[i]};
  pair.source_normal = {block.nx[i], block.ny[i], block.nz[i]};
  pair.target = place(fixed, partner);
  pair.target_normal = normal(fixed, partner);
  pair.difference = minus(pair.source, pair.target);
  pair.distance_square = dot(pair.difference, pair.difference);
  pair.on_surface = dot(pair.target_normal, pair.target_normal) > 0.5F;
  if (!(pair.distance_square <= gate.max_square_m2)) return false;
  const bool both = pair.on_surface && dot(pair.source_normal, pair.source_normal) > 0.5F;
  return !both || dot(pair.source_normal, pair.target_normal) >= gate.cos_normal;
}

float weight_of(float error_square, const PairGate& gate) noexcept {
  const float root = gate.kernel_square_m2 / (gate.kernel_square_m2 + error_square);
  return root * root;
}

}  // namespace

void move_block(const Motion& motion, PointBlock& block) noexcept {
  for (std::size_t i = 0; i < in_lanes(block.size); ++i) {
    const Triple p = moved(motion, {block.x[i], block.y[i], block.z[i]});
    const Triple n = turned(motion, {block.nx[i], block.ny[i], block.nz[i]});
    block.x[i] = p.x;
    block.y[i] = p.y;
    block.z[i] = p.z;
    block.nx[i] = n.x;
    block.ny[i] = n.y;
    block.nz[i] = n.z;
  }
}

void find_voxels(const VoxelShape& shape, const float* x, const float* y, const float* z,
                 std::size_t count, std::int32_t* voxel) noexcept {
  for (std::size_t i = 0; i < count; ++i) voxel[i] = voxel_of(shape, {x[i], y[i], z[i]});
}

void add_plane_pairs(const PointBlock& block, const OrientedPlanes& fixed, const PairGate& gate,
                     PlaneSums& sums) noexcept {
  for (std::size_t i = 0; i < block.size; ++i) {
    Pair pair;
    if (!load_pair(block, fixed, gate, i, pair) || !pair.on_surface) continue;
    const std::size_t lane = i % kLanes;
    Triple n = pair.target_normal;
    Triple lever = minus(pair.source, {gate.centre[0], gate.centre[1], gate.centre[2]});
    if (gate.symmetric) {
      n = {(n.x + pair.source_normal.x) * 0.5F, (n.y + pair.source_normal.y) * 0.5F,
           (n.z + pair.source_normal.z) * 0.5F};
      lever = minus(lever,
                    {pair.difference.x * 0.5F, pair.difference.y * 0.5F, pair.difference.z * 0.5F});
    }
    const float residual = dot(n, pair.difference);
    const float weight = weight_of(residual * residual, gate);
    const float j[6] = {n.x,
                        n.y,
                        n.z,
                        lever.y * n.z - lever.z * n.y,
                        lever.z * n.x - lever.x * n.z,
                        lever.x * n.y - lever.y * n.x};
    int k = 0;
    for (int a = 0; a < 6; ++a) {
      const float scaled = weight * j[a];
      sums.sum[21 + a][lane] += scaled * residual;
      for (int b = a; b < 6; ++b) sums.sum[k++][lane] += scaled * j[b];
    }
    sums.sum[27][lane] += weight * dot(lever, lever);
    sums.sum[28][lane] += weight;
    sums.sum[29][lane] += residual * residual;
    sums.sum[30][lane] += 1.0F;
  }
}

void add_point_pairs(const PointBlock& block, const OrientedPlanes& fixed, const PairGate& gate,
                     PointSums& sums) noexcept {
  const Triple centre{gate.centre[0], gate.centre[1], gate.centre[2]};
  for (std::size_t i = 0; i < block.size; ++i) {
    Pair pair;
    if (!load_pair(block, fixed, gate, i, pair)) continue;
    const std::size_t lane = i % kLanes;
    const float weight = weight_of(pair.distance_square, gate);
    const Triple source = minus(pair.source, centre);
    const Triple target = minus(pair.target, centre);
    const float from[3] = {weight * source.x, weight * source.y, weight * source.z};
    const float to[3] = {target.x, target.y, target.z};
    sums.sum[0][lane] += weight;
    for (int a = 0; a < 3; ++a) {
      sums.sum[1 + a][lane] += from[a];
      sums.sum[4 + a][lane] += weight * to[a];
      for (int b = 0; b < 3; ++b) sums.sum[7 + 3 * a + b][lane] += from[a] * to[b];
    }
    sums.sum[16][lane] += pair.distance_square;
    sums.sum[17][lane] += 1.0F;
  }
}

Sight rate_sight(const OrientedPlanes& samples, std::size_t count, const Motion& motion,
                 const SignedDepth& pixels, const SightLaw& law) noexcept {
  float facing[kLanes] = {};
  float worth[kLanes] = {};
  for (std::size_t i = 0; i < count; ++i) {
    const Triple p = moved(motion, place(samples, i));
    const float toward = -dot(turned(motion, normal(samples, i)), p);
    const float range_square = dot(p, p);
    if (!(toward > 0.0F && p.z > 0.0F)) continue;
    if (!(toward * toward >= law.cos_facing * law.cos_facing * range_square)) continue;
    const float cosine = toward / std::sqrt(range_square);
    const float u = pixels.fx * p.x / p.z + pixels.cx;
    const float v = pixels.fy * p.y / p.z + pixels.cy;
    facing[i % kLanes] += cosine;
    float each = -law.no_reading;
    if (u >= 0.0F && v >= 0.0F && u < static_cast<float>(pixels.width) &&
        v < static_cast<float>(pixels.height)) {
      const auto column = static_cast<std::size_t>(u);
      const auto row = static_cast<std::size_t>(v);
      const float measured = pixels.z[row * static_cast<std::size_t>(pixels.width) + column];
      const float z = std::fabs(measured);
      const float off = (z - p.z) * cosine;
      if (z > 0.0F) {
        each = off > 0.0F ? -law.seen_through : -law.hidden;
        if (std::fabs(off) < law.tolerance_m) {
          each = measured > 0.0F ? 1.0F - off * off * (1.0F / (law.tolerance_m * law.tolerance_m))
                                 : 0.0F;
        }
      }
    }
    worth[i % kLanes] += cosine * each;
  }
  return {fold_lanes(facing), fold_lanes(worth)};
}

float rate_on_surface(const OrientedPlanes& samples, std::size_t count, const Motion& motion,
                      const NamedSurface& surface, float tolerance_m, float cos_normal) noexcept {
  float sum[kLanes] = {};
  for (std::size_t i = 0; i < count; ++i) {
    const Triple p = moved(motion, place(samples, i));
    const std::int32_t voxel = voxel_of(surface.voxels, p);
    if (voxel < 0) continue;
    const auto partner = static_cast<std::size_t>(surface.named[voxel]);
    const Triple gap = minus(place(surface.points, partner), p);
    const float square = dot(gap, gap);
    if (!(square < tolerance_m * tolerance_m)) continue;
    const Triple own = turned(motion, normal(samples, i));
    if (dot(own, own) > 0.5F && dot(own, normal(surface.points, partner)) < cos_normal) continue;
    sum[i % kLanes] += 1.0F - square * (1.0F / (tolerance_m * tolerance_m));
  }
  return fold_lanes(sum);
}

float rate_in_field(const OrientedPlanes& samples, std::size_t count, const Motion& motion,
                    const LevelField& field) noexcept {
  float sum[kLanes] = {};
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t voxel = voxel_of(field.voxels, moved(motion, place(samples, i)));
    if (voxel >= 0) sum[i % kLanes] += field.worth[field.level[voxel]];
  }
  return fold_lanes(sum);
}

}  // namespace grapnel::kernels::reference
