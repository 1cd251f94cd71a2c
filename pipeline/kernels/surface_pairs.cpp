#include "pipeline/kernels/surface_pairs.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/surface_pairs.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "pipeline/kernels/moved-inl.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

void MoveBlock(const Motion& motion, PointBlock& block) {
  const Floats d;
  const MotionVectors m(motion);
  for (std::size_t i = 0; i < in_lanes(block.size); i += hn::Lanes(d)) {
    const Vec3 p = m.Move(Load3(block.x + i, block.y + i, block.z + i));
    const Vec3 n = m.Rotate(Load3(block.nx + i, block.ny + i, block.nz + i));
    hn::StoreU(p.x, d, block.x + i);
    hn::StoreU(p.y, d, block.y + i);
    hn::StoreU(p.z, d, block.z + i);
    hn::StoreU(n.x, d, block.nx + i);
    hn::StoreU(n.y, d, block.ny + i);
    hn::StoreU(n.z, d, block.nz + i);
  }
}

void FindVoxels(const VoxelShape& shape, const float* x, const float* y, const float* z,
                std::size_t count, std::int32_t* voxel) {
  const Floats d;
  for (std::size_t i = 0; i < in_lanes(count); i += hn::Lanes(d)) {
    hn::StoreU(VoxelOf(shape, Load3(x + i, y + i, z + i)), Ints(), voxel + i);
  }
}

/// Along one axis: the voxel of each place, and the one on the side that it lies toward.
struct Sides {
  VI own, other;
};
HWY_INLINE Sides SidesOf(VF place, std::int32_t size) {
  const Floats d;
  const Ints di;
  const VI last = hn::Set(di, size - 1);
  const VI own = hn::Min(hn::Max(hn::ConvertTo(di, place), hn::Zero(di)), last);
  const VF rest = hn::Sub(place, hn::ConvertTo(d, own));
  const auto below = hn::RebindMask(di, hn::Lt(rest, hn::Set(d, 0.5F)));
  const VI one = hn::Set(di, 1);
  const VI toward = hn::IfThenElse(below, hn::Sub(own, one), hn::Add(own, one));
  return {own, hn::Min(hn::Max(toward, hn::Zero(di)), last)};
}

// Points whose eight voxels are looked up between two passes by vectors: entries are fetched one by
// one, which is sooner than gathering them, and long after their places were stored.
constexpr std::size_t kFetched = 32;

struct Corners {
  alignas(64) std::int32_t named[8][kFetched];  // first the voxel, then the point it names
  alignas(64) float x[8][kFetched], y[8][kFetched], z[8][kFetched];
};

HWY_INLINE void PlaceCorners(const VoxelShape& shape, const Vec3& p, std::size_t k,
                             Corners& corners) {
  const Floats d;
  const Ints di;
  const auto there = hn::RebindMask(d, hn::Gt(VoxelOf(shape, p), hn::Set(di, -1)));
  const VF per_metre = hn::Set(d, shape.per_metre);
  Sides sides[3];
  const VF coordinates[3] = {p.x, p.y, p.z};
  for (int axis = 0; axis < 3; ++axis) {
    const VF place = hn::Mul(hn::Sub(coordinates[axis], hn::Set(d, shape.origin[axis])), per_metre);
    sides[axis] = SidesOf(hn::IfThenElseZero(there, place), shape.size[axis]);
  }
  for (int corner = 0; corner < 8; ++corner) {
    const VI x = (corner & 1) != 0 ? sides[0].other : sides[0].own;
    const VI y = (corner & 2) != 0 ? sides[1].other : sides[1].own;
    const VI z = (corner & 4) != 0 ? sides[2].other : sides[2].own;
    const VI row = hn::Add(hn::Mul(z, hn::Set(di, shape.size[1])), y);
    hn::Store(hn::Add(hn::Mul(row, hn::Set(di, shape.size[0])), x), di, corners.named[corner] + k);
  }
}

HWY_INLINE void FetchCorners(const NamedPoints& points, std::size_t count, Corners& corners) {
  for (int corner = 0; corner < 8; ++corner) {
    for (std::size_t k = 0; k < count; ++k) {
      const std::int32_t named = points.named[corners.named[corner][k]];
      corners.named[corner][k] = named;
      corners.x[corner][k] = points.x[named];
      corners.y[corner][k] = points.y[named];
      corners.z[corner][k] = points.z[named];
    }
  }
}

/// The nearest of a point's eight, -1 = none is near enough.
HWY_INLINE VI NearestCorner(const Corners& corners, std::size_t k, const Vec3& p,
                            hn::Mask<Floats> there, float max_distance_m) {
  const Floats d;
  const Ints di;
  VI best = hn::Set(di, -1);
  VF best_square = hn::Set(d, max_distance_m * max_distance_m);
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 gap = Minus({hn::Load(d, corners.x[corner] + k), hn::Load(d, corners.y[corner] + k),
                            hn::Load(d, corners.z[corner] + k)},
                           p);
    const VF square = Dot(gap, gap);
    const auto nearer = hn::And(there, hn::Le(square, best_square));
    best_square = hn::IfThenElse(nearer, square, best_square);
    best =
        hn::IfThenElse(hn::RebindMask(di, nearer), hn::Load(di, corners.named[corner] + k), best);
  }
  return best;
}

void FindNearestNamed(const NamedPoints& points, const float* x, const float* y, const float* z,
                      std::size_t count, float max_distance_m, std::int32_t* found) {
  const Floats d;
  const Ints di;
  Corners corners;
  for (std::size_t first = 0; first < in_lanes(count); first += kFetched) {
    const std::size_t end = std::min(in_lanes(count), first + kFetched);
    for (std::size_t i = first; i < end; i += hn::Lanes(d)) {
      PlaceCorners(points.voxels, Load3(x + i, y + i, z + i), i - first, corners);
    }
    FetchCorners(points, end - first, corners);
    for (std::size_t i = first; i < end; i += hn::Lanes(d)) {
      const Vec3 p = Load3(x + i, y + i, z + i);
      const auto there = hn::RebindMask(d, hn::Gt(VoxelOf(points.voxels, p), hn::Set(di, -1)));
      hn::StoreU(NearestCorner(corners, i - first, p, there, max_distance_m), di, found + i);
    }
  }
}

/// Some pairs at once: what both error measures need.
struct Pairs {
  Vec3 source, target, difference, source_normal, target_normal;
  VF distance_square;
  hn::Mask<Floats> counts;      ///< near, and the normals agree where both are
  hn::Mask<Floats> on_surface;  ///< the partner has a normal
};

/// The partners of a block.
struct Partners {
  alignas(64) float x[kBlockPoints], y[kBlockPoints], z[kBlockPoints];
  alignas(64) float nx[kBlockPoints], ny[kBlockPoints], nz[kBlockPoints];
};

HWY_INLINE void FetchPartners(const PointBlock& block, const OrientedPlanes& fixed,
                              Partners& partners) {
  for (std::size_t k = 0; k < in_lanes(block.size); ++k) {
    const std::int32_t at = std::max(block.partner[k], 0);
    partners.x[k] = fixed.x[at];
    partners.y[k] = fixed.y[at];
    partners.z[k] = fixed.z[at];
    partners.nx[k] = fixed.nx[at];
    partners.ny[k] = fixed.ny[at];
    partners.nz[k] = fixed.nz[at];
  }
}

HWY_INLINE Pairs LoadPairs(const PointBlock& block, const Partners& partners, const PairGate& gate,
                           std::size_t i) {
  const Floats d;
  const Ints di;
  const VI partner = hn::LoadU(di, block.partner + i);
  const auto found = hn::RebindMask(d, hn::Gt(partner, hn::Set(di, -1)));
  Pairs pairs;
  pairs.source = Load3(block.x + i, block.y + i, block.z + i);
  pairs.source_normal = Load3(block.nx + i, block.ny + i, block.nz + i);
  pairs.target = Load3(partners.x + i, partners.y + i, partners.z + i);
  pairs.target_normal = Load3(partners.nx + i, partners.ny + i, partners.nz + i);
  pairs.difference = Minus(pairs.source, pairs.target);
  pairs.distance_square = Dot(pairs.difference, pairs.difference);
  const VF half = hn::Set(d, 0.5F);
  // A normal is unit, or zero where there is none.
  const auto source_has = hn::Gt(Dot(pairs.source_normal, pairs.source_normal), half);
  pairs.on_surface = hn::Gt(Dot(pairs.target_normal, pairs.target_normal), half);
  const auto both = hn::And(source_has, pairs.on_surface);
  const VF cosine = Dot(pairs.source_normal, pairs.target_normal);
  const auto turned_away = hn::And(both, hn::Lt(cosine, hn::Set(d, gate.cos_normal)));
  const auto near = hn::Le(pairs.distance_square, hn::Set(d, gate.max_square_m2));
  pairs.counts = hn::AndNot(turned_away, hn::And(found, near));
  return pairs;
}

HWY_INLINE VF Weight(const Pairs& pairs, VF error_square, const PairGate& gate) {
  const Floats d;
  const VF kernel = hn::Set(d, gate.kernel_square_m2);
  const VF root = hn::Div(kernel, hn::Add(kernel, error_square));
  return hn::IfThenElseZero(pairs.counts, hn::Mul(root, root));
}

HWY_INLINE void AddTo(float* sum, VF value) {
  const Floats d;
  hn::Store(hn::Add(hn::Load(d, sum), value), d, sum);
}

void AddPlanePairs(const PointBlock& block, const OrientedPlanes& fixed, const PairGate& gate,
                   PlaneSums& sums) {
  const Floats d;
  const Vec3 centre = {hn::Set(d, gate.centre[0]), hn::Set(d, gate.centre[1]),
                       hn::Set(d, gate.centre[2])};
  const VF half = hn::Set(d, 0.5F);
  const VF one = hn::Set(d, 1.0F);
  Partners partners;
  FetchPartners(block, fixed, partners);
  for (std::size_t i = 0; i < in_lanes(block.size); i += hn::Lanes(d)) {
    const std::size_t lane = i % kLanes;
    Pairs pairs = LoadPairs(block, partners, gate, i);
    pairs.counts = hn::And(pairs.counts, pairs.on_surface);
    Vec3 direction = pairs.target_normal;
    Vec3 lever = Minus(pairs.source, centre);
    if (gate.symmetric) {
      const Vec3 n = {hn::Add(direction.x, pairs.source_normal.x),
                      hn::Add(direction.y, pairs.source_normal.y),
                      hn::Add(direction.z, pairs.source_normal.z)};
      direction = {hn::Mul(n.x, half), hn::Mul(n.y, half), hn::Mul(n.z, half)};
      const Vec3 back = {hn::Mul(pairs.difference.x, half), hn::Mul(pairs.difference.y, half),
                         hn::Mul(pairs.difference.z, half)};
      lever = Minus(lever, back);
    }
    const VF residual = Dot(direction, pairs.difference);
    const VF square = hn::Mul(residual, residual);
    const VF weight = Weight(pairs, square, gate);
    const VF j[6] = {direction.x,
                     direction.y,
                     direction.z,
                     hn::Sub(hn::Mul(lever.y, direction.z), hn::Mul(lever.z, direction.y)),
                     hn::Sub(hn::Mul(lever.z, direction.x), hn::Mul(lever.x, direction.z)),
                     hn::Sub(hn::Mul(lever.x, direction.y), hn::Mul(lever.y, direction.x))};
    int k = 0;
    for (int a = 0; a < 6; ++a) {
      const VF scaled = hn::Mul(weight, j[a]);
      AddTo(sums.sum[21 + a] + lane, hn::Mul(scaled, residual));
      for (int b = a; b < 6; ++b) AddTo(sums.sum[k++] + lane, hn::Mul(scaled, j[b]));
    }
    AddTo(sums.sum[27] + lane, hn::Mul(weight, Dot(lever, lever)));
    AddTo(sums.sum[28] + lane, weight);
    AddTo(sums.sum[29] + lane, hn::IfThenElseZero(pairs.counts, square));
    AddTo(sums.sum[30] + lane, hn::IfThenElseZero(pairs.counts, one));
  }
}

void AddPointPairs(const PointBlock& block, const OrientedPlanes& fixed, const PairGate& gate,
                   PointSums& sums) {
  const Floats d;
  const Vec3 centre = {hn::Set(d, gate.centre[0]), hn::Set(d, gate.centre[1]),
                       hn::Set(d, gate.centre[2])};
  const VF one = hn::Set(d, 1.0F);
  Partners partners;
  FetchPartners(block, fixed, partners);
  for (std::size_t i = 0; i < in_lanes(block.size); i += hn::Lanes(d)) {
    const std::size_t lane = i % kLanes;
    const Pairs pairs = LoadPairs(block, partners, gate, i);
    const VF weight = Weight(pairs, pairs.distance_square, gate);
    const Vec3 source = Minus(pairs.source, centre);
    const Vec3 target = Minus(pairs.target, centre);
    AddTo(sums.sum[0] + lane, weight);
    const VF from[3] = {hn::Mul(weight, source.x), hn::Mul(weight, source.y),
                        hn::Mul(weight, source.z)};
    const VF to[3] = {target.x, target.y, target.z};
    for (int a = 0; a < 3; ++a) {
      AddTo(sums.sum[1 + a] + lane, from[a]);
      AddTo(sums.sum[4 + a] + lane, hn::Mul(weight, to[a]));
      for (int b = 0; b < 3; ++b) AddTo(sums.sum[7 + 3 * a + b] + lane, hn::Mul(from[a], to[b]));
    }
    AddTo(sums.sum[16] + lane, hn::IfThenElseZero(pairs.counts, pairs.distance_square));
    AddTo(sums.sum[17] + lane, hn::IfThenElseZero(pairs.counts, one));
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(MoveBlock);
HWY_EXPORT(FindVoxels);
HWY_EXPORT(FindNearestNamed);
HWY_EXPORT(AddPlanePairs);
HWY_EXPORT(AddPointPairs);

void move_block(const Motion& motion, PointBlock& block) noexcept {
  HWY_DYNAMIC_DISPATCH(MoveBlock)(motion, block);
}

void find_voxels(const VoxelShape& shape, const float* x, const float* y, const float* z,
                 std::size_t count, std::int32_t* voxel) noexcept {
  HWY_DYNAMIC_DISPATCH(FindVoxels)(shape, x, y, z, count, voxel);
}

void find_nearest_named(const NamedPoints& points, const float* x, const float* y, const float* z,
                        std::size_t count, float max_distance_m, std::int32_t* found) noexcept {
  HWY_DYNAMIC_DISPATCH(FindNearestNamed)(points, x, y, z, count, max_distance_m, found);
}

void add_plane_pairs(const PointBlock& block, const OrientedPlanes& fixed, const PairGate& gate,
                     PlaneSums& sums) noexcept {
  HWY_DYNAMIC_DISPATCH(AddPlanePairs)(block, fixed, gate, sums);
}

void add_point_pairs(const PointBlock& block, const OrientedPlanes& fixed, const PairGate& gate,
                     PointSums& sums) noexcept {
  HWY_DYNAMIC_DISPATCH(AddPointPairs)(block, fixed, gate, sums);
}

}  // namespace grapnel::kernels
#endif
