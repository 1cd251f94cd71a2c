#include "pipeline/kernels/spread_claims.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/spread_claims.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Claims = hn::CappedTag<Claim, 8>;
using VC = hn::Vec<Claims>;

// A line of voxels or, side by side, as many lines as a vector has lanes; unclaimed at both ends,
// and as far behind as a second vector reaches.
constexpr std::size_t kRows = kMaxClaimSide + 2 * kMaxClaimReach + 1;
constexpr std::size_t kBehind = 16;

/// What a step of k voxels costs.
struct Costs {
  Claim of[kMaxClaimReach + 1];
  Costs() {
    for (int k = 0; k <= kMaxClaimReach; ++k) {
      of[k] = static_cast<Claim>(k) * static_cast<Claim>(k) * kClaimUnit;
    }
  }
};

/// The least claims around `at` and around `next`, whose neighbours along the axis lie `step`
/// elements apart: two at once, which share the cost.
struct Two {
  VC first, second;
};
HWY_INLINE Two Least(const Claim* at, const Claim* next, std::size_t step, std::size_t reach,
                     const Costs& costs) {
  const Claims d;
  Two least = {hn::LoadU(d, at), hn::LoadU(d, next)};
  std::size_t away = step;
  for (std::size_t k = 1; k <= reach; ++k, away += step) {
    const VC cost = hn::Set(d, costs.of[k]);
    const VC first = hn::Min(hn::LoadU(d, at - away), hn::LoadU(d, at + away));
    const VC second = hn::Min(hn::LoadU(d, next - away), hn::LoadU(d, next + away));
    least.first = hn::Min(least.first, hn::Add(first, cost));
    least.second = hn::Min(least.second, hn::Add(second, cost));
  }
  return least;
}

/// A line of neighbouring elements.
HWY_INLINE void SpreadLine(std::size_t count, std::size_t reach, const Costs& costs, Claim* buffer,
                           Claim* line) {
  const Claims d;
  const std::size_t lanes = hn::Lanes(d);
  Claim least = kUnclaimed;
  for (std::size_t i = 0; i < count; ++i) least = std::min(least, line[i]);
  if (least >= kUnclaimed) return;
  Claim* const own = buffer + kMaxClaimReach;
  std::copy_n(line, count, own);
  std::size_t i = 0;
  for (; i + 2 * lanes <= count; i += 2 * lanes) {
    const Two claims = Least(own + i, own + i + lanes, 1, reach, costs);
    hn::StoreU(claims.first, d, line + i);
    hn::StoreU(claims.second, d, line + i + lanes);
  }
  if (i == count) return;
  alignas(64) Claim rest[kBehind];
  const Two claims = Least(own + i, own + i + lanes, 1, reach, costs);
  hn::Store(claims.first, d, rest);
  hn::Store(claims.second, d, rest + lanes);
  std::copy_n(rest, count - i, line + i);
}

/// `width` <= lanes neighbouring lines whose elements lie `step` apart.
HWY_INLINE void SpreadColumns(std::size_t count, std::size_t step, std::size_t width,
                              std::size_t reach, const Costs& costs, Claim* buffer, Claim* first) {
  const Claims d;
  const std::size_t lanes = hn::Lanes(d);
  const auto there = hn::FirstN(d, width);
  const bool all = width == lanes;
  const VC none = hn::Set(d, kUnclaimed);
  Claim* const own = buffer + kMaxClaimReach * lanes;
  VC least = none;
  for (std::size_t k = 0; k < count; ++k) {
    const Claim* const from = first + k * step;
    const VC here =
        all ? hn::LoadU(d, from) : hn::IfThenElse(there, hn::MaskedLoad(there, d, from), none);
    hn::Store(here, d, own + k * lanes);
    least = hn::Min(least, here);
  }
  if (hn::AllTrue(d, hn::Eq(least, none))) return;
  const auto store = [&](VC claim, std::size_t k) {
    if (all) {
      hn::StoreU(claim, d, first + k * step);
    } else {
      hn::BlendedStore(claim, there, d, first + k * step);
    }
  };
  for (std::size_t k = 0; k < count; k += 2) {
    const Claim* const at = own + k * lanes;
    const Two claims = Least(at, at + lanes, lanes, reach, costs);
    store(claims.first, k);
    if (k + 1 < count) store(claims.second, k + 1);
  }
}

void SpreadClaims(int axis, const std::int32_t* size, int reach, Claim* claims) {
  const Claims d;
  const std::size_t lanes = hn::Lanes(d);
  const Costs costs;
  alignas(64) Claim buffer[kRows * 8 + kBehind];
  const auto count = static_cast<std::size_t>(size[axis]);
  std::fill_n(buffer, (count + 2 * kMaxClaimReach + 1) * (axis == 0 ? 1 : lanes) + kBehind,
              kUnclaimed);
  const auto side_x = static_cast<std::size_t>(size[0]);
  const auto side_y = static_cast<std::size_t>(size[1]);
  const auto side_z = static_cast<std::size_t>(size[2]);
  const auto within = static_cast<std::size_t>(reach);
  if (axis == 0) {
    for (std::size_t line = 0; line < side_y * side_z; ++line) {
      SpreadLine(count, within, costs, buffer, claims + line * side_x);
    }
    return;
  }
  // Slabs whose elements lie side by side, and steps across them.
  const std::size_t slabs = axis == 1 ? side_z : 1;
  const std::size_t step = axis == 1 ? side_x : side_x * side_y;
  for (std::size_t slab = 0; slab < slabs; ++slab) {
    Claim* const first = claims + slab * side_x * side_y;
    for (std::size_t i = 0; i < step; i += lanes) {
      SpreadColumns(count, step, std::min(lanes, step - i), within, costs, buffer, first + i);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(SpreadClaims);

void spread_claims(int axis, const std::int32_t (&size)[3], int reach, Claim* claims) noexcept {
  HWY_DYNAMIC_DISPATCH(SpreadClaims)(axis, size, reach, claims);
}

}  // namespace grapnel::kernels
#endif
