#include "pipeline/kernels/surface_changes.h"

#include <algorithm>
#include <cmath>

#include "pipeline/kernels/compress_table.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/surface_changes.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<float, 8>;
using Ints = hn::RebindToSigned<Lanes>;
using Words = hn::RebindToUnsigned<Lanes>;
using V = hn::Vec<Lanes>;
using M = hn::Mask<Lanes>;

HWY_INLINE V Number(float value) { return hn::Set(Lanes(), value); }

/// Votes that wait for their cells, and room for a vector behind the last.
constexpr std::size_t kWaiting = 64;
struct Waiting {
  float vote[kWaiting + 16];
  float dx[kWaiting + 16];
  float dy[kWaiting + 16];
  float dz[kWaiting + 16];
  std::size_t count = 0;
};

struct Packer {
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4 || HWY_TARGET == HWY_SSSE3
  explicit Packer(M kept) {
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(Lanes(), kept, bits);
    lanes = hn::LoadU(Ints(), kLanesOf[bits[0]].data());
  }
  HWY_INLINE void Store(V value, float* to) const {
    hn::StoreU(hn::TableLookupLanes(value, hn::IndicesFromVec(Lanes(), lanes)), Lanes(), to);
  }
  hn::Vec<Ints> lanes;
#else
  explicit Packer(M kept_lanes) : kept(kept_lanes) {}
  HWY_INLINE void Store(V value, float* to) const {
    hn::StoreU(hn::Compress(value, kept), Lanes(), to);
  }
  M kept;
#endif
};

/// Cell of each cosine to the first axis, the angle's sign lost, folded into -90…90 degrees.
HWY_INLINE hn::Vec<Ints> CellOf(V cosine) {
  const Ints di;
  // cos of 10, 20, … 80 degrees.
  constexpr float kEdges[] = {0.98480775F, 0.93969262F, 0.86602540F, 0.76604444F,
                              0.64278761F, 0.5F,        0.34202014F, 0.17364818F};
  const V size = hn::Abs(cosine);
  auto below = hn::Zero(di);
  for (const float edge : kEdges) {
    below = hn::Sub(below, hn::VecFromMask(di, hn::RebindMask(di, hn::Le(size, Number(edge)))));
  }
  // 0…8 before 90 degrees, 9…17 from there on; the fold exchanges the halves.
  const auto before = hn::RebindMask(di, hn::Gt(cosine, hn::Zero(Lanes())));
  const auto cell =
      hn::IfThenElse(before, hn::Add(below, hn::Set(di, 9)), hn::Sub(hn::Set(di, 8), below));
  const auto opposite = hn::RebindMask(di, hn::Le(cosine, Number(-1.0F)));
  return hn::IfThenElse(opposite, hn::Set(di, 9), cell);
}

void CountWaiting(const ChangeView& view, Waiting& waiting, ChangeVotes& votes) {
  const Lanes d;
  const Ints di;
  const std::size_t lanes = hn::Lanes(d);
  alignas(64) std::int32_t cell[kWaiting + 16];
  for (std::size_t i = 0; i < waiting.count; i += lanes) {
    const V dx = hn::LoadU(d, waiting.dx + i);
    const V dy = hn::LoadU(d, waiting.dy + i);
    const V dz = hn::LoadU(d, waiting.dz + i);
    const V x = hn::Add(hn::Mul(Number(view.across_x), dx), hn::Mul(Number(view.across_z), dz));
    const V y = hn::Add(hn::Add(hn::Mul(Number(view.up_x), dx), hn::Mul(Number(view.up_y), dy)),
                        hn::Mul(Number(view.up_z), dz));
    const V length = hn::Sqrt(hn::Add(hn::Mul(x, x), hn::Mul(y, y)));
    const auto seen = hn::Gt(length, hn::Zero(d));
    const V cosine =
        hn::IfThenElseZero(seen, hn::Div(x, hn::IfThenElse(seen, length, Number(1.0F))));
    hn::StoreU(CellOf(cosine), di, cell + i);
  }
  for (std::size_t i = 0; i < waiting.count; ++i) {
    float& strongest = votes.cell[cell[i]];
    strongest = std::max(strongest, waiting.vote[i]);
  }
  waiting.count = 0;
}

/// Columns whose bit is set.
HWY_INLINE M Reached(hn::Vec<Ints> u, std::int32_t left, std::uint64_t bits) {
  const Words dw;
  const auto column = hn::BitCast(dw, hn::Sub(u, hn::Set(Ints(), left)));
  const auto low = hn::Set(dw, static_cast<std::uint32_t>(bits));
  const auto high = hn::Set(dw, static_cast<std::uint32_t>(bits >> 32));
  const auto word = hn::IfThenElse(hn::Lt(column, hn::Set(dw, 32U)), low, high);
  const auto shifted = hn::Shr(word, hn::And(column, hn::Set(dw, 31U)));
  const auto one = hn::Set(dw, 1U);
  const auto set = hn::Eq(hn::And(shifted, one), one);
  return hn::RebindMask(Lanes(), hn::And(set, hn::Lt(column, hn::Set(dw, 64U))));
}

void AddVotes(const ChangePlanes& changes, std::span<const ChangeRow> rows, const ChangeView& view,
              ChangeVotes& votes) {
  const Lanes d;
  const Ints di;
  const V zero = hn::Zero(d);
  const V one = Number(1.0F);
  const V least = Number(view.least);
  V calmest = Number(votes.calm);
  Waiting waiting;
  for (const ChangeRow& row : rows) {
    const std::int32_t down = row.down < 0 ? -row.down : row.down;
    for (std::int32_t i = row.range.begin; i < row.range.end;
         i += static_cast<std::int32_t>(hn::Lanes(d))) {
      const V px = hn::Sub(hn::LoadU(d, changes.x + i), Number(view.x));
      const V py = hn::Sub(hn::LoadU(d, changes.y + i), Number(view.y));
      const V pz = hn::Sub(hn::LoadU(d, changes.z + i), Number(view.z));
      const V squared = hn::Add(hn::Add(hn::Mul(px, px), hn::Mul(py, py)), hn::Mul(pz, pz));
      const auto u = hn::LoadU(di, changes.u + i);
      const auto across = hn::Abs(hn::Sub(u, hn::Set(di, view.u)));
      const auto in_row = hn::Lt(hn::Iota(di, i), hn::Set(di, row.range.end));
      M inside = hn::Le(squared, Number(view.squared_m2));
      if (down <= 2) {
        inside = hn::Or(inside, hn::RebindMask(d, hn::Lt(across, hn::Set(di, 3))));
      }
      inside = hn::And(inside, hn::RebindMask(d, in_row));
      if (!view.every_column) inside = hn::And(inside, Reached(u, view.left, row.reached));
      if (hn::AllFalse(d, inside)) continue;
      const V change = hn::LoadU(d, changes.change + i);
      const V distance = hn::Mul(hn::Sqrt(squared), Number(view.per_radius));
      V vote = hn::Mul(change, hn::Sub(one, distance));
      M beside = hn::Lt(zero, zero);
      if (down < 2) {
        beside = hn::RebindMask(d, hn::Lt(across, hn::Set(di, 2)));
        vote = hn::IfThenElse(beside, change, vote);
      }
      const V near = hn::Max(hn::Sub(one, hn::Mul(distance, Number(view.per_optimal))), zero);
      const V calm = hn::Sub(one, hn::Mul(hn::Mul(Number(0.5F), change), near));
      const M disturbs = view.every_column ? hn::And(inside, beside) : inside;
      calmest = hn::Min(calmest, hn::IfThenElse(disturbs, calm, one));
      const M votes_here = hn::And(inside, hn::Ge(vote, least));
      const std::size_t count = hn::CountTrue(d, votes_here);
      if (count == 0) continue;
      if (waiting.count + count > kWaiting) CountWaiting(view, waiting, votes);
      const Packer packer(votes_here);
      packer.Store(vote, waiting.vote + waiting.count);
      packer.Store(hn::LoadU(d, changes.dx + i), waiting.dx + waiting.count);
      packer.Store(hn::LoadU(d, changes.dy + i), waiting.dy + waiting.count);
      packer.Store(hn::LoadU(d, changes.dz + i), waiting.dz + waiting.count);
      waiting.count += count;
    }
  }
  CountWaiting(view, waiting, votes);
  votes.calm = hn::GetLane(hn::MinOfLanes(d, calmest));
}

void OpenPixels(const RangePlanes& image, const std::uint8_t* state, std::ptrdiff_t at,
                const PixelWindow& window, const Sphere& sphere, std::uint64_t* open) {
  const Lanes d;
  const Ints di;
  const hn::Rebind<std::uint8_t, Lanes> bytes;
  const V cx = Number(sphere.x);
  const V cy = Number(sphere.y);
  const V cz = Number(sphere.z);
  const V limit = Number(sphere.squared_m2);
  const std::uint64_t all =
      window.columns >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << window.columns) - 1;
  const std::int32_t first = window.centre_column - 2;
  const std::uint64_t beside =
      first >= 0 ? std::uint64_t{31} << first : std::uint64_t{31} >> -first;
  for (std::int32_t row = 0; row < window.rows; ++row) {
    const std::ptrdiff_t begin = at + row * image.stride;
    std::uint64_t not_closed = 0;
    std::uint64_t within = 0;
    for (std::int32_t i = 0; i < window.columns; i += static_cast<std::int32_t>(hn::Lanes(d))) {
      const V dx = hn::Sub(hn::LoadU(d, image.x + begin + i), cx);
      const V dy = hn::Sub(hn::LoadU(d, image.y + begin + i), cy);
      const V dz = hn::Sub(hn::LoadU(d, image.z + begin + i), cz);
      const V squared = hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz));
      const auto states = hn::PromoteTo(di, hn::LoadU(bytes, state + begin + i));
      std::uint8_t bits[2][8] = {};
      hn::StoreMaskBits(d, hn::Le(squared, limit), bits[0]);
      hn::StoreMaskBits(di, hn::Ne(states, hn::Set(di, 2)), bits[1]);
      within |= std::uint64_t{bits[0][0]} << i;
      not_closed |= std::uint64_t{bits[1][0]} << i;
    }
    const std::int32_t down = row - window.centre_row;
    if (down >= -2 && down <= 2) within |= beside;
    open[row] = not_closed & within & all;
  }
}

float SpreadOf(const ChangeVotes& votes) {
  const Lanes d;
  constexpr int kPadded = 24;
  constexpr int kHalfRound = kDirectionCells / 2;
  float round[kPadded + kHalfRound + 8] = {};
  for (int i = 0; i < kDirectionCells + kHalfRound; ++i) {
    round[i] = votes.cell[i % kDirectionCells];
  }
  V best = hn::Zero(d);
  // Cells farther apart are nearer the other way round.
  for (int apart = 1; apart <= kHalfRound; ++apart) {
    const V weight = Number(static_cast<float>(2 * apart) / kDirectionCells);
    for (int i = 0; i < kPadded; i += static_cast<int>(hn::Lanes(d))) {
      const V product = hn::Mul(hn::LoadU(d, round + i), hn::LoadU(d, round + i + apart));
      best = hn::Max(best, hn::Mul(product, weight));
    }
  }
  return std::sqrt(hn::GetLane(hn::MaxOfLanes(d, best)));
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(AddVotes);
HWY_EXPORT(OpenPixels);
HWY_EXPORT(SpreadOf);

void add_votes(const ChangePlanes& changes, std::span<const ChangeRow> rows, const ChangeView& view,
               ChangeVotes& votes) noexcept {
  HWY_DYNAMIC_DISPATCH(AddVotes)(changes, rows, view, votes);
}

void open_pixels(const RangePlanes& image, const std::uint8_t* state, std::ptrdiff_t at,
                 const PixelWindow& window, const Sphere& sphere, std::uint64_t* open) noexcept {
  HWY_DYNAMIC_DISPATCH(OpenPixels)(image, state, at, window, sphere, open);
}

float spread_of(const ChangeVotes& votes) noexcept { return HWY_DYNAMIC_DISPATCH(SpreadOf)(votes); }

}  // namespace grapnel::kernels
#endif
