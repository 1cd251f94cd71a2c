#include "pipeline/kernels/best_rows.h"

#include <array>
#include <bit>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/best_rows.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Each operation: the sum after one more element. kGrows: it never falls, so that a sum already too
// large may be given up.
struct SquaredDifference {
  static constexpr bool kGrows = true;
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V Add(D, V sum, V a, V b) {
    const V difference = hn::Sub(a, b);
    return hn::Add(sum, hn::Mul(difference, difference));
  }
};
struct Difference {
  static constexpr bool kGrows = true;
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V Add(D, V sum, V a, V b) {
    return hn::Add(sum, hn::Abs(hn::Sub(a, b)));
  }
};
struct LargestDifference {
  static constexpr bool kGrows = true;
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V Add(D, V sum, V a, V b) {
    return hn::Max(sum, hn::Abs(hn::Sub(a, b)));
  }
};
struct RootOfDifference {
  static constexpr bool kGrows = true;
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V Add(D, V sum, V a, V b) {
    return hn::Add(sum, hn::Sqrt(hn::Abs(hn::Sub(a, b))));
  }
};
struct ChiSquare {
  static constexpr bool kGrows = true;
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V Add(D d, V sum, V a, V b) {
    const V difference = hn::Sub(a, b);
    const V both = hn::Add(a, b);
    const auto empty = hn::Eq(both, hn::Zero(d));
    const V term =
        hn::Div(hn::Mul(difference, difference), hn::IfThenElse(empty, hn::Set(d, 1.0F), both));
    return hn::Add(sum, hn::IfThenZeroElse(empty, term));
  }
};
struct Product {
  static constexpr bool kGrows = false;
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V Add(D, V sum, V a, V b) {
    return hn::Sub(sum, hn::Mul(a, b));
  }
};
struct Least {
  static constexpr bool kGrows = false;
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V Add(D, V sum, V a, V b) {
    return hn::Sub(sum, hn::Min(a, b));
  }
};

/// Rows come in rising order, so that a tie keeps the lower one.
HWY_INLINE void Insert(float score, std::int32_t row, std::size_t kept, BestRow* best) {
  if (!(score < best[kept - 1].score)) return;
  std::size_t place = kept - 1;
  for (; place > 0 && score < best[place - 1].score; --place) best[place] = best[place - 1];
  best[place] = {score, row};
}

template <class D>
struct Sums {
  hn::Vec<D> of[kQueriesAtOnce];
};

/// Elements begin…end of the rows at `from` against the four queries.
template <class Op, class D>
HWY_INLINE void AddElements(D d, const float* const* queries, const float* from, std::size_t begin,
                            std::size_t end, Sums<D>& sums) {
  auto s0 = sums.of[0];
  auto s1 = sums.of[1];
  auto s2 = sums.of[2];
  auto s3 = sums.of[3];
  for (std::size_t i = begin; i < end; ++i) {
    const auto values = hn::LoadU(d, from + i * kRowsInBlock);
    s0 = Op::Add(d, s0, hn::Set(d, queries[0][i]), values);
    s1 = Op::Add(d, s1, hn::Set(d, queries[1][i]), values);
    s2 = Op::Add(d, s2, hn::Set(d, queries[2][i]), values);
    s3 = Op::Add(d, s3, hn::Set(d, queries[3][i]), values);
  }
  sums = {{s0, s1, s2, s3}};
}

template <class D>
HWY_INLINE bool AnyBelow(D d, const Sums<D>& sums, const float* limits) {
  const auto below = hn::Or(
      hn::Or(hn::Lt(sums.of[0], hn::Set(d, limits[0])), hn::Lt(sums.of[1], hn::Set(d, limits[1]))),
      hn::Or(hn::Lt(sums.of[2], hn::Set(d, limits[2])), hn::Lt(sums.of[3], hn::Set(d, limits[3]))));
  return !hn::AllFalse(d, below);
}

template <class Op>
void Search(const RowBlocks& rows, const float* const* queries, std::size_t count, std::size_t kept,
            BestRow* const* best) {
  using D = hn::CappedTag<float, kRowsInBlock>;
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  const std::size_t early = Op::kGrows ? rows.length / 4 : 0;
  // Absent queries repeat the first one and want nothing.
  std::array<float, kQueriesAtOnce> limits;
  limits.fill(-std::numeric_limits<float>::infinity());
  for (std::size_t q = 0; q < count; ++q) limits[q] = best[q][kept - 1].score;
  HWY_ALIGN std::array<float, kRowsInBlock> scores;
  for (std::size_t b = 0; b < rows.block_count; ++b) {
    for (std::size_t lane = 0; lane < kRowsInBlock; lane += lanes) {
      const float* from = rows.blocks + b * kRowsInBlock * rows.length + lane;
      const auto bias = hn::LoadU(d, rows.bias + b * kRowsInBlock + lane);
      Sums<D> sums{{bias, bias, bias, bias}};
      if (Op::kGrows) {
        AddElements<Op>(d, queries, from, 0, early, sums);
        if (!AnyBelow(d, sums, limits.data())) continue;
      }
      AddElements<Op>(d, queries, from, early, rows.length, sums);
      if (!AnyBelow(d, sums, limits.data())) continue;
      const auto first = static_cast<std::int32_t>(b * kRowsInBlock + lane);
      for (std::size_t q = 0; q < count; ++q) {
        std::uint8_t below = 0;
        hn::StoreMaskBits(d, hn::Lt(sums.of[q], hn::Set(d, limits[q])), &below);
        if (below == 0) continue;
        hn::Store(sums.of[q], d, scores.data());
        for (unsigned bits = below; bits != 0; bits &= bits - 1) {
          const int k = std::countr_zero(bits);
          Insert(scores[static_cast<std::size_t>(k)], first + k, kept, best[q]);
        }
        limits[q] = best[q][kept - 1].score;
      }
    }
  }
}

void SearchRows(RowScore score, const RowBlocks& rows, const float* const* queries,
                std::size_t count, std::size_t kept, BestRow* const* best) {
  switch (score) {
    case RowScore::SquaredDifference:
      return Search<SquaredDifference>(rows, queries, count, kept, best);
    case RowScore::Difference:
      return Search<Difference>(rows, queries, count, kept, best);
    case RowScore::LargestDifference:
      return Search<LargestDifference>(rows, queries, count, kept, best);
    case RowScore::RootOfDifference:
      return Search<RootOfDifference>(rows, queries, count, kept, best);
    case RowScore::ChiSquare:
      return Search<ChiSquare>(rows, queries, count, kept, best);
    case RowScore::Product:
      return Search<Product>(rows, queries, count, kept, best);
    case RowScore::Least:
      return Search<Least>(rows, queries, count, kept, best);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(SearchRows);

void best_rows(RowScore score, const RowBlocks& rows, const float* const* queries,
               std::size_t count, std::size_t kept, BestRow* const* best) noexcept {
  std::array<const float*, kQueriesAtOnce> four{};
  for (std::size_t q = 0; q < kQueriesAtOnce; ++q) four[q] = queries[q < count ? q : 0];
  HWY_DYNAMIC_DISPATCH(SearchRows)(score, rows, four.data(), count, kept, best);
}

}  // namespace grapnel::kernels
#endif
