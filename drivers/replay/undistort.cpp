#include "drivers/replay/undistort.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace grapnel {

std::vector<std::uint32_t> undistortion_map(const CameraFile& camera) {
  const auto none = [](double value) { return value == 0.0; };
  if (std::all_of(camera.distortion.begin(), camera.distortion.end(), none)) return {};
  std::array<double, 5> d{};
  std::copy(camera.distortion.begin(), camera.distortion.end(), d.begin());
  const auto [k1, k2, p1, p2, k3] = d;
  const Intrinsics k = camera.intrinsics();
  std::vector<std::uint32_t> map;
  map.reserve(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  for (int v = 0; v < camera.height; ++v) {
    const double y = (v - k.cy) / k.fy;
    for (int u = 0; u < camera.width; ++u) {
      const double x = (u - k.cx) / k.fx;
      const double r2 = x * x + y * y;
      const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
      const double xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
      const double yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
      const double column = std::floor(k.fx * xd + k.cx + 0.5);
      const double row = std::floor(k.fy * yd + k.cy + 0.5);
      const bool inside =
          column >= 0.0 && column < camera.width && row >= 0.0 && row < camera.height;
      map.push_back(inside ? static_cast<std::uint32_t>(row * camera.width + column) : kNoSource);
    }
  }
  return map;
}

}  // namespace grapnel
