#include "pipeline/kernels/window_nearest.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "pipeline/kernels/window_nearest.cpp"
#include "hwy/foreach_target.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace grapnel {
namespace kernels {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void NearestInWindow(const PixelPlanes& planes, std::ptrdiff_t first,
                     const WindowSelection& selection, float* sum_m, float* farthest_m2) {
  const hn::CappedTag<float, kLanes> d;
  alignas(64) float square[kMaxWindowPoints][kLanes];
  for (std::size_t lane = 0; lane < kLanes; lane += hn::Lanes(d)) {
    const std::ptrdiff_t centre = first + static_cast<std::ptrdiff_t>(lane);
    const auto x = hn::LoadU(d, planes.x + centre);
    const auto y = hn::LoadU(d, planes.y + centre);
    const auto z = hn::LoadU(d, planes.z + centre);
    std::size_t k = 0;
    for (const WindowSelection::Offset& offset : selection.offsets()) {
      const std::ptrdiff_t at = centre + offset.dv * planes.stride + offset.du;
      const auto dx = hn::Sub(hn::LoadU(d, planes.x + at), x);
      const auto dy = hn::Sub(hn::LoadU(d, planes.y + at), y);
      const auto dz = hn::Sub(hn::LoadU(d, planes.z + at), z);
      hn::Store(hn::Add(hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy)), hn::Mul(dz, dz)), d,
                square[k++]);
    }
    for (const WindowSelection::Exchange& exchange : selection.exchanges()) {
      const auto a = hn::Load(d, square[exchange.low]);
      const auto b = hn::Load(d, square[exchange.high]);
      hn::Store(hn::Min(a, b), d, square[exchange.low]);
      hn::Store(hn::Max(a, b), d, square[exchange.high]);
    }
    auto sum = hn::Zero(d);
    for (std::size_t i = 0; i < selection.nearest(); ++i) {
      sum = hn::Add(sum, hn::Sqrt(hn::Load(d, square[i])));
    }
    hn::StoreU(sum, d, sum_m + lane);
    hn::StoreU(hn::Load(d, square[selection.nearest() - 1]), d, farthest_m2 + lane);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace kernels
}  // namespace grapnel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace grapnel::kernels {

HWY_EXPORT(NearestInWindow);

WindowSelection::WindowSelection(int reach, std::size_t nearest)
    : reach_(reach), nearest_(nearest) {
  for (int dv = -reach; dv <= reach; ++dv) {
    for (int du = -reach; du <= reach; ++du) {
      if (du != 0 || dv != 0) offsets_.push_back({du, dv});
    }
  }
  const std::size_t count = offsets_.size();
  std::size_t top = 1;
  while (2 * top < count) top *= 2;
  std::vector<Exchange> all;
  for (std::size_t p = top; p > 0; p /= 2) {
    std::size_t r = 0;
    std::size_t distance = p;
    for (std::size_t q = top;; q /= 2) {
      for (std::size_t i = 0; i + distance < count; ++i) {
        if ((i & p) != r) continue;
        all.push_back({static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i + distance)});
      }
      if (q == p) break;
      distance = q - p;
      r = p;
    }
  }
  std::vector<bool> needed(count, false);
  std::fill_n(needed.begin(), nearest, true);
  for (auto exchange = all.rbegin(); exchange != all.rend(); ++exchange) {
    if (!needed[exchange->low] && !needed[exchange->high]) continue;
    needed[exchange->low] = needed[exchange->high] = true;
    exchanges_.push_back(*exchange);
  }
  std::reverse(exchanges_.begin(), exchanges_.end());
}

void nearest_in_window(const PixelPlanes& planes, std::ptrdiff_t first,
                       const WindowSelection& selection, float* sum_m,
                       float* farthest_m2) noexcept {
  HWY_DYNAMIC_DISPATCH(NearestInWindow)(planes, first, selection, sum_m, farthest_m2);
}

}  // namespace grapnel::kernels
#endif
