#include "pipeline/kernels/median_row.h"

#include <algorithm>
#include <array>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/median_row.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class V>
HWY_INLINE void Exchange(V& low, V& high) {
  const V smaller = hn::Min(low, high);
  high = hn::Max(low, high);
  low = smaller;
}

template <int kI, int kEnd, int kSize, class V>
HWY_INLINE void PairUp(V* w) {
  if constexpr (kI < kEnd) {
    Exchange(w[kI], w[kSize - 1 - kI]);
    PairUp<kI + 1, kEnd, kSize>(w);
  }
}
template <int kI, int kEnd, class V>
HWY_INLINE void LowestFirst(V* w) {
  if constexpr (kI < kEnd) {
    Exchange(w[0], w[kI]);
    LowestFirst<kI + 1, kEnd>(w);
  }
}
template <int kI, int kEnd, class V>
HWY_INLINE void HighestLast(V* w) {
  if constexpr (kI < kEnd) {
    Exchange(w[kI], w[kEnd]);
    HighestLast<kI + 1, kEnd>(w);
  }
}

/// "Forgetful selection": of the kSize values the lowest and the highest can't be the median; they
/// go, and the next of `rest` takes the lowest one's place.
template <int kSize, class V>
HWY_INLINE V Select(V* w, const V* rest) {
  if constexpr (kSize == 3) {
    Exchange(w[0], w[1]);
    Exchange(w[1], w[2]);
    Exchange(w[0], w[1]);
    return w[1];
  } else {
    PairUp<0, kSize / 2, kSize>(w);
    LowestFirst<1, (kSize + 1) / 2>(w);
    HighestLast<kSize / 2, kSize - 1>(w);
    w[0] = *rest;
    return Select<kSize - 1>(w, rest + 1);
  }
}

template <int kWindow, class D>
HWY_INLINE hn::Vec<D> Median(D d, const std::uint16_t* const* rows, std::size_t u) {
  constexpr int kCount = kWindow * kWindow;
  using V = hn::Vec<D>;
  V values[kCount];
  V lowest = hn::LoadU(d, rows[0] + u);
  for (int i = 0; i < kCount; ++i) {
    values[i] = hn::LoadU(d, rows[i / kWindow] + u + static_cast<std::size_t>(i % kWindow));
    lowest = hn::Min(lowest, values[i]);
  }
  const V zero = hn::Zero(d);
  const V centre = values[kCount / 2];
  if (!hn::AllFalse(d, hn::Eq(lowest, zero))) {
    // Gaps count in turn as the highest and the lowest value: the median of all is then the (upper)
    // median of the readings.
    V stand_in = hn::Set(d, std::uint16_t{0xffff});
    for (int i = 0; i < kCount; ++i) {
      const V gap = hn::VecFromMask(d, hn::Eq(values[i], zero));
      values[i] = hn::Or(values[i], hn::And(gap, stand_in));
      stand_in = hn::Xor(stand_in, gap);
    }
  }
  constexpr int kStart = kCount / 2 + 2;
  const V median = Select<kStart>(values, values + kStart);
  return hn::IfThenZeroElse(hn::Eq(centre, zero), median);
}

/// Takes the lowest of kSize values out: the others stay in w[1]….
template <int kSize, class V>
HWY_INLINE void DropLowest(V* w) {
  V low = w[0];
  for (int i = 1; i < kSize; ++i) {
    const V higher = hn::Max(low, w[i]);
    low = hn::Min(low, w[i]);
    w[i] = higher;
  }
}
/// Takes the highest of kSize values out: the others stay in w[0]….
template <int kSize, class V>
HWY_INLINE void DropHighest(V* w) {
  V high = w[kSize - 1];
  for (int i = kSize - 2; i >= 0; --i) {
    const V lower = hn::Min(high, w[i]);
    high = hn::Max(high, w[i]);
    w[i] = lower;
  }
}

constexpr std::size_t kStretch = 240;  ///< outputs whose columns are sorted together
constexpr std::size_t kColumns = kStretch + 4 + kDepthSlack;
/// The i-th lowest of five rows in each column.
using SortedColumns = std::uint16_t[5][kColumns];

template <class D>
HWY_INLINE void SortColumns(D d, const std::uint16_t* const* rows, std::size_t u,
                            std::size_t columns, SortedColumns& sorted) {
  for (std::size_t c = 0; c < columns; c += hn::Lanes(d)) {
    hn::Vec<D> w[5];
    for (int i = 0; i < 5; ++i) w[i] = hn::LoadU(d, rows[i] + u + c);
    Exchange(w[0], w[1]);
    Exchange(w[3], w[4]);
    Exchange(w[2], w[4]);
    Exchange(w[2], w[3]);
    Exchange(w[0], w[3]);
    Exchange(w[1], w[4]);
    Exchange(w[0], w[2]);
    Exchange(w[1], w[3]);
    Exchange(w[1], w[2]);
    for (int i = 0; i < 5; ++i) hn::StoreU(w[i], d, sorted[i] + c);
  }
}

/// Median of 25 values without gaps. With its columns sorted, and then its rows, a value at place p
/// of row r has r p - 1 others not above it and (6 - r)(6 - p) - 1 not below it: of the 25 places
/// twelve can't be the thirteenth, six too low and six too high.
template <class D>
HWY_INLINE hn::Vec<D> MedianOfColumns(D d, const SortedColumns& sorted, std::size_t c) {
  using V = hn::Vec<D>;
  V w[5][5];
  for (std::size_t r = 0; r < 5; ++r) {
    for (std::size_t p = 0; p < 5; ++p) w[r][p] = hn::LoadU(d, sorted[r] + c + p);
  }
  DropLowest<5>(w[0]);
  DropLowest<4>(w[0] + 1);
  DropLowest<3>(w[0] + 2);
  DropLowest<5>(w[1]);
  DropLowest<4>(w[1] + 1);
  DropLowest<5>(w[2]);
  DropHighest<4>(w[2] + 1);
  DropHighest<5>(w[3]);
  DropHighest<4>(w[3]);
  DropHighest<5>(w[4]);
  DropHighest<4>(w[4]);
  DropHighest<3>(w[4]);
  V left[13] = {w[0][3], w[0][4], w[1][2], w[1][3], w[1][4], w[2][1], w[2][2],
                w[2][3], w[3][0], w[3][1], w[3][2], w[4][0], w[4][1]};
  return Select<8>(left, left + 8);
}

void MedianOfThree(const std::uint16_t* const* rows, std::size_t width, std::uint16_t* out) {
  const hn::CappedTag<std::uint16_t, kDepthSlack> d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t u = 0;
  for (; u + lanes <= width; u += lanes) hn::StoreU(Median<3>(d, rows, u), d, out + u);
  if (u < width) {
    HWY_ALIGN std::array<std::uint16_t, kDepthSlack> last;
    hn::StoreU(Median<3>(d, rows, u), d, last.data());
    std::copy_n(last.begin(), width - u, out + u);
  }
}

void MedianOfFive(const std::uint16_t* const* rows, std::size_t width, std::uint16_t* out) {
  const hn::CappedTag<std::uint16_t, kDepthSlack> d;
  const std::size_t lanes = hn::Lanes(d);
  const auto zero = hn::Zero(d);
  SortedColumns sorted{};  // behind the last column lanes are read that nobody keeps
  for (std::size_t first = 0; first < width; first += kStretch) {
    const std::size_t count = std::min(kStretch, width - first);
    SortColumns(d, rows, first, count + 4, sorted);
    for (std::size_t c = 0; c < count; c += lanes) {
      auto lowest = hn::LoadU(d, sorted[0] + c);
      for (std::size_t p = 1; p < 5; ++p) {
        lowest = hn::Min(lowest, hn::LoadU(d, sorted[0] + c + p));
      }
      const bool whole = hn::AllFalse(d, hn::Eq(lowest, zero));
      const auto median = whole ? MedianOfColumns(d, sorted, c) : Median<5>(d, rows, first + c);
      if (c + lanes <= count) {
        hn::StoreU(median, d, out + first + c);
      } else {
        HWY_ALIGN std::array<std::uint16_t, kDepthSlack> last;
        hn::StoreU(median, d, last.data());
        std::copy_n(last.begin(), count - c, out + first + c);
      }
    }
  }
}

void MedianRow(const std::uint16_t* const* rows, int window, std::size_t width,
               std::uint16_t* out) {
  if (window == 5) {
    MedianOfFive(rows, width, out);
  } else {
    MedianOfThree(rows, width, out);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(MedianRow);

void median_row(const std::uint16_t* const* rows, int window, std::size_t width,
                std::uint16_t* out) noexcept {
  HWY_DYNAMIC_DISPATCH(MedianRow)(rows, window, width, out);
}

}  // namespace grapnel::kernels
#endif
