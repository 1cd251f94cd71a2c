#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/replay/camera_file.h"

namespace grapnel {

inline constexpr std::uint32_t kNoSource = 0xffffffffu;

/// For each pixel of the ideal pinhole image, the nearest pixel of the distorted one (Brown 1966:
/// radial k1 k2 k3, tangential p1 p2), or kNoSource outside it. Empty when there is no distortion.
[[nodiscard]] std::vector<std::uint32_t> undistortion_map(const CameraFile& camera);

/// The same without allocating; `scratch` has as many pixels.
template <class Pixel>
void undistort(std::span<const std::uint32_t> map, std::span<Pixel> pixels,
               std::span<Pixel> scratch) noexcept {
  std::copy(pixels.begin(), pixels.end(), scratch.begin());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    pixels[i] = map[i] == kNoSource ? Pixel{} : scratch[map[i]];
  }
}

/// Fetches `map`'s pixels; nearest, never mixed, since a mean of two depths is a depth of nothing.
template <class Pixel>
void undistort(std::span<const std::uint32_t> map, std::span<Pixel> pixels) {
  std::vector<Pixel> scratch(pixels.size());
  undistort(map, pixels, std::span<Pixel>(scratch));
}

}  // namespace grapnel
