#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct CropParams {
  double min_x_m = -1000.0, min_y_m = -1000.0, min_z_m = -1000.0;
  double max_x_m = 1000.0, max_y_m = 1000.0, max_z_m = 1000.0;
  bool inside = true;  ///< keep what lies in the box; else what lies outside of it
};
[[nodiscard]] FieldTable crop_fields() noexcept;

/// Keeps the points of a box, its faces included, or those outside of it.
class Crop final : public CloudFilter {
 public:
  explicit Crop(const CropParams& params) noexcept : params_(params) {}

  /// Room for clouds of the limits' max_input_points.
  void reserve(Arena& arena, const Limits& limits) override;
  /// Errors: TooFewPoints, CapacityExceeded, BadParameter (not finite).
  Result<std::size_t> apply(Surface& surface) noexcept override;

 private:
  CropParams params_;
  std::span<std::uint8_t> keep_;
};

}  // namespace grapnel
