#pragma once

#include <cstdint>
#include <vector>

#include "base/field.h"
#include "base/geometry.h"
#include "base/image.h"
#include "base/rng.h"

namespace grapnel {

/// What a structured-light sensor of Kinect's kind does to a true depth image.
struct StructuredLightParams {
  bool noise = true;
  double sigma_per_m = 1.425e-3;
  int correlation_px = 7;
  double disparity_step_px = 0.125;
  bool shadow = true;
  double mixed_ratio = 0.4;
  double grazing_rad = 1.36;
  double min_signal = 0.03;
  int invalid_columns = 8;
  double min_range_m = 0.4;
  double max_range_m = 4.0;
};
/// The rows of StructuredLightParams.
[[nodiscard]] FieldTable structured_light_fields();

/// True surface per pixel, as the camera sees it. All images have the camera's size.
struct SurfaceImages {
  ImageView<const float> inverse_depth;  ///< 1/m; 0 = nothing there
  ImageView<const float> cos_incidence;  ///< between ray and normal, 0…1
  ImageView<const float> albedo;         ///< infrared reflectance, 0…1
  /// 1/m of the nearest surface that the projector sees in its column; `projector_offset_px`
  /// columns of it lie left of the camera's first. Empty: no shadow.
  ImageView<const float> projector_inverse_depth;
  int projector_offset_px = 0;
};

/// Turns true surfaces into depth counts: infrared disparity d = f·b/z with a projector `baseline`
/// to the right of the camera (Khoshelham and Elberink 2012), spatially correlated noise,
/// quantised disparity, projector shadow, mixed pixels at edges, dropouts. A frame's noise is a
/// function of seed and frame number alone.
class StructuredLight {
 public:
  StructuredLight(const Intrinsics& intrinsics, double baseline_m, double metres_per_unit,
                  const StructuredLightParams& params);

  /// Fills `depth` (camera's size, 0 = no reading). O(pixels); takes no memory.
  void measure(const SurfaceImages& surface, std::uint64_t seed, std::uint64_t frame,
               ImageView<std::uint16_t> depth);

  /// Pixel share of standard deviation of the disparity before quantisation, so that noise and
  /// quantisation together give sigma_z = sigma_per_m · z².
  [[nodiscard]] double noise_sigma_px() const { return noise_sigma_px_; }

 private:
  void find_disparity(const SurfaceImages& surface);
  void drop_shadow(const SurfaceImages& surface);
  void drop_weak(const SurfaceImages& surface, const Rng& rng);
  void mix_edges(const Rng& rng);
  void make_noise(const Rng& rng);
  void quantise(ImageView<std::uint16_t> depth) const;

  Intrinsics intrinsics_;
  double focal_baseline_;  // px·m
  double metres_per_unit_;
  StructuredLightParams params_;
  double noise_sigma_px_;
  std::vector<float> disparity_;  // px; 0 = no reading
  std::vector<float> mixed_;
  std::vector<float> noise_px_;
  std::vector<std::int32_t> white_;     // with a border of correlation_px - 1
  std::vector<std::int32_t> row_sums_;  // white, summed along rows
  std::vector<std::int32_t> column_sum_;
};

}  // namespace grapnel
