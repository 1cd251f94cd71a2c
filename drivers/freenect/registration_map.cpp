#include "drivers/freenect/registration_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace grapnel {
namespace {

constexpr unsigned kMaxMm = FREENECT_DEPTH_MM_MAX_VALUE;
constexpr std::int32_t kFixedPoint = 256;

KinectConstants constants_of(const freenect_registration& unit) {
  const freenect_zero_plane_info& plane = unit.zero_plane_info;
  return {static_cast<double>(plane.reference_distance),
          static_cast<double>(plane.reference_pixel_size),
          static_cast<double>(plane.dcmos_emitter_dist), static_cast<double>(unit.const_shift)};
}

}  // namespace

RegistrationMap::RegistrationMap(freenect_device* device) {
  freenect_registration unit = freenect_copy_registration(device);
  const freenect_zero_plane_info& plane = unit.zero_plane_info;
  focal_px_ = static_cast<double>(plane.reference_distance) /
              (2.0 * static_cast<double>(plane.reference_pixel_size));
  baseline_m_ = 0.01 * static_cast<double>(plane.dcmos_emitter_dist);
  start_lines_ = unit.reg_pad_info.start_lines;
  const KinectConstants constants = constants_of(unit);
  for (int raw = 0; raw < kKinectNoReading; ++raw) {
    const double steps = kinect_depth_mm(raw, constants) / (1000.0 * kFineUnit_m) + 0.5;
    const bool reading = steps >= 1.0 && steps < static_cast<double>(kMaxMm) / 1000.0 / kFineUnit_m;
    fine_[static_cast<std::size_t>(raw)] =
        reading ? static_cast<std::uint16_t>(steps) : std::uint16_t{0};
  }
  shift_.assign(unit.depth_to_rgb_shift, unit.depth_to_rgb_shift + kMaxMm);
  table_.resize(kKinectPixels);
  for (std::size_t i = 0; i < kKinectPixels; ++i) {
    table_[i] = {unit.registration_table[i][0], unit.registration_table[i][1] - start_lines_};
  }
  freenect_destroy_registration(&unit);
  targets_.resize(kKinectPixels);
  nearest_.resize(kKinectPixels);
}

Intrinsics RegistrationMap::intrinsics() const noexcept {
  return {kKinectWidth, kKinectHeight,      focal_px_,
          focal_px_,    kKinectWidth / 2.0, kKinectHeight / 2.0};
}

int RegistrationMap::target_of(std::size_t pixel, unsigned depth_mm) const noexcept {
  if (depth_mm == 0 || depth_mm >= kMaxMm) return -1;
  const std::int32_t x = (table_[pixel][0] + shift_[depth_mm]) / kFixedPoint;
  const std::int32_t y = table_[pixel][1];
  const bool inside = x >= 0 && x < kKinectWidth && y >= 0 && y < kKinectHeight;
  return inside ? y * kKinectWidth + x : -1;
}

void RegistrationMap::color_of_depth(const std::uint16_t* depth, double mm_per_unit,
                                     const Rgb8* color, Rgb8* out) {
  std::fill(nearest_.begin(), nearest_.end(), std::numeric_limits<std::uint16_t>::max());
  for (std::size_t i = 0; i < kKinectPixels; ++i) {
    const auto mm = static_cast<unsigned>(static_cast<double>(depth[i]) * mm_per_unit + 0.5);
    const int target = target_of(i, mm);
    targets_[i] = target;
    if (target < 0) continue;
    std::uint16_t& nearest = nearest_[static_cast<std::size_t>(target)];
    nearest = std::min(nearest, depth[i]);
  }
  for (std::size_t i = 0; i < kKinectPixels; ++i) {
    out[i] = Rgb8{};
    if (targets_[i] < 0) continue;
    const auto target = static_cast<std::size_t>(targets_[i]);
    if (depth[i] == nearest_[target]) out[i] = color[target];
  }
}

}  // namespace grapnel
