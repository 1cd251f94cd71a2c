#include "pipeline/kernels/spin_cells.h"

#include <algorithm>
#include <array>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/spin_cells.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Arc cosine of 0…1, error below 2e-7 (Abramowitz and Stegun 1964, 4.4.46).
template <class D, class V = hn::Vec<D>>
HWY_INLINE V ArcCosine(D d, V x) {
  V p = hn::Set(d, -0.0012624911F);
  p = hn::Add(hn::Mul(p, x), hn::Set(d, 0.0066700901F));
  p = hn::Add(hn::Mul(p, x), hn::Set(d, -0.0170881256F));
  p = hn::Add(hn::Mul(p, x), hn::Set(d, 0.0308918810F));
  p = hn::Add(hn::Mul(p, x), hn::Set(d, -0.0501743046F));
  p = hn::Add(hn::Mul(p, x), hn::Set(d, 0.0889789874F));
  p = hn::Add(hn::Mul(p, x), hn::Set(d, -0.2145988016F));
  p = hn::Add(hn::Mul(p, x), hn::Set(d, 1.5707963050F));
  return hn::Mul(hn::Sqrt(hn::Sub(hn::Set(d, 1.0F), x)), p);
}

/// The cell of a place counted in cells, and how far into it: the last cell keeps its upper edge.
template <class D, class V = hn::Vec<D>>
HWY_INLINE hn::Vec<hn::RebindToSigned<D>> Cell(D d, V place, float last, V& into) {
  const hn::RebindToSigned<D> di;
  const V inside = hn::Max(place, hn::Zero(d));
  const V cell = hn::Min(hn::Floor(inside), hn::Set(d, last));
  into = hn::Min(hn::Sub(inside, cell), hn::Set(d, 1.0F));
  return hn::ConvertTo(di, cell);
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE void Vote(D d, const SpinFrame& f, hn::Vec<hn::RebindToSigned<D>> index,
                     const OrientedPlanes& points, const SpinVotes& votes, std::size_t i) {
  const hn::RebindToSigned<D> di;
  const V zero = hn::Zero(d);
  const V one = hn::Set(d, 1.0F);
  const auto dot = [&](V x, V y, V z) {
    return hn::Add(hn::Add(hn::Mul(x, hn::Set(d, f.nx)), hn::Mul(y, hn::Set(d, f.ny))),
                   hn::Mul(z, hn::Set(d, f.nz)));
  };
  const V dx = hn::Sub(hn::GatherIndex(d, points.x, index), hn::Set(d, f.x));
  const V dy = hn::Sub(hn::GatherIndex(d, points.y, index), hn::Set(d, f.y));
  const V dz = hn::Sub(hn::GatherIndex(d, points.z, index), hn::Set(d, f.z));
  const V squared = hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
  const V length = hn::Sqrt(squared);
  const V along = dot(dx, dy, dz);
  auto drop = hn::Eq(length, zero);
  if (f.min_cos > 0.0F || f.angular) {
    const V cos_normals =
        hn::Abs(dot(hn::GatherIndex(d, points.nx, index), hn::GatherIndex(d, points.ny, index),
                    hn::GatherIndex(d, points.nz, index)));
    drop = hn::Or(drop, hn::Lt(cos_normals, hn::Set(d, f.min_cos)));
    if (f.angular) hn::StoreU(ArcCosine(d, hn::Min(cos_normals, one)), d, votes.angle_rad + i);
  }
  const auto width = static_cast<float>(f.width);
  const V per_cell = hn::Set(d, 1.0F / f.cell_m);
  V row;
  V column;
  if (f.radial) {
    const V sine = hn::Div(along, hn::IfThenElse(hn::Eq(length, zero), one, length));
    const V size = hn::Sub(hn::Set(d, 1.57079633F), ArcCosine(d, hn::Min(hn::Abs(sine), one)));
    const V elevation = hn::IfThenElse(hn::Lt(sine, zero), hn::Neg(size), size);
    row = hn::Mul(length, per_cell);
    column = hn::Mul(elevation, hn::Set(d, width * 0.636619772F));
  } else {
    row = hn::Mul(hn::Sqrt(hn::Max(hn::Sub(squared, hn::Mul(along, along)), zero)), per_cell);
    column = hn::Mul(along, per_cell);
    const V limit = hn::Set(d, width);
    drop = hn::Or(drop, hn::Or(hn::Ge(row, limit), hn::Ge(hn::Abs(column), limit)));
  }
  V to_next_row;
  V to_next_column;
  const auto row_cell = Cell(d, row, width - 1.0F, to_next_row);
  const auto column_cell =
      Cell(d, hn::Add(column, hn::Set(d, width)), 2.0F * width - 1.0F, to_next_column);
  const auto cell = hn::Add(hn::Mul(row_cell, hn::Set(di, 2 * f.width + 1)), column_cell);
  hn::StoreU(hn::IfThenElse(hn::RebindMask(di, drop), hn::Set(di, -1), cell), di, votes.cell + i);
  hn::StoreU(to_next_row, d, votes.to_next_row + i);
  hn::StoreU(to_next_column, d, votes.to_next_column + i);
}

void VoteAll(const OrientedPlanes& points, const SpinFrame& frame,
             std::span<const std::int32_t> others, const SpinVotes& votes) {
  const hn::CappedTag<float, 8> d;
  const hn::RebindToSigned<decltype(d)> di;
  const std::size_t lanes = hn::Lanes(d);
  HWY_ALIGN std::array<std::int32_t, 8> last;
  for (std::size_t i = 0; i < others.size(); i += lanes) {
    const std::int32_t* from = others.data() + i;
    if (i + lanes > others.size()) {
      last.fill(others.back());
      std::copy(from, others.data() + others.size(), last.begin());
      from = last.data();
    }
    Vote(d, frame, hn::LoadU(di, from), points, votes, i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(VoteAll);

void spin_votes(const OrientedPlanes& points, const SpinFrame& frame,
                std::span<const std::int32_t> others, const SpinVotes& votes) noexcept {
  HWY_DYNAMIC_DISPATCH(VoteAll)(points, frame, others, votes);
}

}  // namespace grapnel::kernels
#endif
