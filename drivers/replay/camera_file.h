#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/config.h"
#include "base/field.h"
#include "base/geometry.h"

namespace grapnel {

/// A camera.toml: what the depth images of a recording, or a bare depth PNG, were taken with.
struct CameraFile {
  int width = 0;   ///< px
  int height = 0;  ///< px
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;
  double metres_per_unit = 0.001;
  std::vector<double> distortion;  ///< k1 k2 p1 p2 k3 (Brown 1966), as many as needed; empty: none
  double baseline_m = 0.075;
  std::vector<double> invalid = {0.0, 65535.0};  ///< counts that mean "no reading"; 0 always does
  std::string serial;
  bool corrected = false;  ///< the stored depth and colour went through the unit's calibration
  /// fx…cy are of the infrared image, whose pixel (u + shift 0, v + shift 1) is depth pixel (u, v);
  /// empty: they are of the depth image.
  std::vector<double> ir_shift_px;
  std::vector<double> disparity_law;  ///< offset in 1/m, scale: 1/z' = offset + scale/z; or empty
  int grid_columns = 0;               ///< of the grid of depth multipliers; 0: none
  int grid_rows = 0;
  std::vector<double> grid_distances_m;  ///< at which it was measured, ascending
  std::vector<double> grid_multipliers;  ///< by distance, row, column

  /// Of the depth image.
  [[nodiscard]] Intrinsics intrinsics() const noexcept {
    const bool shifted = ir_shift_px.size() == 2;
    return {width,
            height,
            fx,
            fy,
            cx - (shifted ? ir_shift_px[0] : 0.0),
            cy - (shifted ? ir_shift_px[1] : 0.0)};
  }
  [[nodiscard]] bool corrects_depth() const noexcept {
    return !disparity_law.empty() || grid_columns > 0;
  }
  /// Whether the frames that come of it are corrected: here, or before they were stored.
  [[nodiscard]] bool corrects() const noexcept {
    return corrected || corrects_depth() || !distortion.empty();
  }
  [[nodiscard]] static FieldTable fields() noexcept;
};

/// Throw InputError naming file, line, key, value and what is allowed.
[[nodiscard]] CameraFile read_camera_file(const std::filesystem::path& file);
[[nodiscard]] CameraFile parse_camera_file(const ConfigTable& table);

/// Makes every count that means "no reading" 0.
void erase_invalid(const CameraFile& camera, std::span<std::uint16_t> depth) noexcept;

/// The file's text: a line a key with its meaning and unit as a comment. Keys that correct depth
/// are left out where they say nothing, so that any reader of recordings knows the others.
[[nodiscard]] std::string camera_file_text(const CameraFile& camera);

}  // namespace grapnel
