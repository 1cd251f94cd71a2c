#pragma once

#include <cstddef>
#include <cstdint>

#include "base/geometry.h"
#include "base/image.h"

namespace grapnel {

/// One exposure as the pipeline sees it. The pixels belong to somebody else (a frame pool's lease).
struct DepthFrame {
  ImageView<const std::uint16_t>
      depth;                       ///< H×W counts; 0 = no reading (drivers map other markers to 0)
  double metres_per_unit = 0.001;  ///< depth in metres = count × metres_per_unit
  ImageView<const Rgb8> color;     ///< empty, or H×W registered to the depth
  Intrinsics intrinsics;           ///< of the depth image
  double baseline_m = 0.075;  ///< projector to camera; structured light's shadow and disparity law
  std::int64_t exposure_us = 0;    ///< host monotonic time of mid-exposure
  std::int64_t device_us = 0;      ///< device time unwrapped to 64 bit
  std::uint64_t sequence = 0;      ///< counts frames of the sensor, gaps included
  std::uint32_t lost_packets = 0;  ///< of this frame; its gaps may hold stale pixels
  bool recorded = false;           ///< from a recording: not live
  bool corrected = false;          ///< by the unit's calibration: not to be corrected once more
};

/// Share of the pixels that have a reading. O(pixels).
[[nodiscard]] inline double valid_share(const DepthFrame& frame) noexcept {
  std::size_t valid = 0;
  for (int v = 0; v < frame.depth.height; ++v) {
    const std::uint16_t* const row = frame.depth.row(v);
    for (int u = 0; u < frame.depth.width; ++u) valid += row[u] != 0 ? 1U : 0U;
  }
  return frame.depth.empty()
             ? 0.0
             : static_cast<double>(valid) / static_cast<double>(frame.depth.pixels());
}

}  // namespace grapnel
