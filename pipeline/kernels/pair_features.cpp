#include "pipeline/kernels/pair_features.h"

#include <algorithm>
#include <array>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/pair_features.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"
#include "pipeline/kernels/pair_bins-inl.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void CountPairCells(const OrientedPlanes& points, std::size_t count, int bins,
                    const PairCellCounts& counts) {
  const hn::CappedTag<float, 8> d;
  const hn::RebindToSigned<decltype(d)> di;
  const std::size_t lanes = hn::Lanes(d);
  using V = hn::Vec<decltype(d)>;
  const auto side = static_cast<float>(bins);
  const auto row = hn::Set(di, bins);
  const auto nowhere = hn::Set(di, bins * bins * bins);
  HWY_ALIGN std::array<std::int32_t, 8> cells;
  for (std::size_t i = 1; i < count; ++i) {
    const Vector3<V> p{hn::Set(d, points.x[i]), hn::Set(d, points.y[i]), hn::Set(d, points.z[i])};
    const Vector3<V> np{hn::Set(d, points.nx[i]), hn::Set(d, points.ny[i]),
                        hn::Set(d, points.nz[i])};
    const auto end = hn::Set(di, static_cast<std::int32_t>(i));
    for (std::size_t j = 0; j < i; j += lanes) {
      const Vector3<V> q{hn::LoadU(d, points.x + j), hn::LoadU(d, points.y + j),
                         hn::LoadU(d, points.z + j)};
      const Vector3<V> nq{hn::LoadU(d, points.nx + j), hn::LoadU(d, points.ny + j),
                          hn::LoadU(d, points.nz + j)};
      const auto b = BinsOfPairs(d, p, np, q, nq, side);
      const auto cell = hn::Add(b.f1, hn::Mul(row, hn::Add(b.f2, hn::Mul(row, b.f3))));
      const auto here = hn::Iota(di, static_cast<std::int32_t>(j));
      const auto drop = hn::Or(b.none, hn::Not(hn::Lt(here, end)));
      hn::Store(hn::IfThenElse(drop, nowhere, cell), di, cells.data());
      // Neighbouring pairs fall into the same cell: counting in turn into four tables keeps one
      // count from waiting for the last.
      for (std::size_t k = 0; k < lanes; ++k) {
        ++counts.table[k % kPairCellTables][static_cast<std::size_t>(cells[k])];
      }
    }
  }
}

void PairBinsOf(const float* points, std::int32_t point_i, std::span<const std::int32_t> others,
                std::int32_t* bins) {
  const hn::CappedTag<float, 8> d;
  const hn::RebindToSigned<decltype(d)> di;
  const std::size_t lanes = hn::Lanes(d);
  using V = hn::Vec<decltype(d)>;
  const float* own = points + static_cast<std::size_t>(point_i) * kOrientedRow;
  const Vector3<V> p{hn::Set(d, own[0]), hn::Set(d, own[1]), hn::Set(d, own[2])};
  const Vector3<V> np{hn::Set(d, own[3]), hn::Set(d, own[4]), hn::Set(d, own[5])};
  HWY_ALIGN std::array<std::int32_t, 8> last;
  for (std::size_t i = 0; i < others.size(); i += lanes) {
    const std::int32_t* from = others.data() + i;
    if (i + lanes > others.size()) {
      last.fill(point_i);
      std::copy(from, others.data() + others.size(), last.begin());
      from = last.data();
    }
    const auto q = LoadPoints(d, points, from);
    const auto found = BinsOfPairs(d, p, np, q.place, q.normal, static_cast<float>(kPairBins));
    hn::StoreU(Packed(d, found), di, bins + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(PairBinsOf);
HWY_EXPORT(CountPairCells);

void pair_bins(const float* points, std::int32_t point_i, std::span<const std::int32_t> others,
               std::int32_t* bins) noexcept {
  HWY_DYNAMIC_DISPATCH(PairBinsOf)(points, point_i, others, bins);
}

void count_pair_cells(const OrientedPlanes& points, std::size_t count, int bins,
                      const PairCellCounts& counts) noexcept {
  HWY_DYNAMIC_DISPATCH(CountPairCells)(points, count, bins, counts);
}

}  // namespace grapnel::kernels
#endif
