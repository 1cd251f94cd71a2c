#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "pipeline/keypoints/range_image.h"

namespace grapnel {

/// PCL's RangeImageBorderExtractor::Parameters with its defaults.
struct BorderParams {
  int border_radius_px = 3;
  int plane_radius_px = 2;
  int direction_radius_px = 2;
  int curvature_radius_px = 2;
  double min_probability = 0.8;
};

/// Where a range image's surfaces end or bend (Steder et al. 2011, as PCL's
/// RangeImageBorderExtractor): obstacle borders, the shadow borders behind them, veil points
/// between the two, and how much and in which direction the surface changes at each pixel. Plain
/// loops in double.
class RangeBorders {
 public:
  void reserve(Arena& arena, std::size_t max_pixels);
  /// `min_change`: directions of smaller changes are not needed. The image must stay as it is.
  void extract(const RangeImage& image, const BorderParams& params, double min_change) noexcept;

  [[nodiscard]] bool obstacle(std::size_t pixel) const noexcept {
    return (traits_[pixel] & kObstacle) != 0;
  }
  /// A shadow border or a veil point: of no surface.
  [[nodiscard]] bool excluded(std::size_t pixel) const noexcept {
    return (traits_[pixel] & (kShadow | kVeil)) != 0;
  }
  [[nodiscard]] bool shadow(std::size_t pixel) const noexcept {
    return (traits_[pixel] & kShadow) != 0;
  }
  [[nodiscard]] bool veil(std::size_t pixel) const noexcept {
    return (traits_[pixel] & kVeil) != 0;
  }
  /// 0…1; 1 at borders.
  [[nodiscard]] float change(std::size_t pixel) const noexcept { return change_[pixel]; }
  [[nodiscard]] const Vec3f& direction(std::size_t pixel) const noexcept {
    return direction_[pixel];
  }

 private:
  static constexpr std::uint8_t kObstacle = 1;
  static constexpr std::uint8_t kShadow = 2;
  static constexpr std::uint8_t kVeil = 4;
  static constexpr std::size_t kSides = 4;  ///< left, right, top, bottom

  void fit_surface(int u, int v) noexcept;
  [[nodiscard]] float distance_change(int u, int v, int du, int dv, int radius) const noexcept;
  void score_borders() noexcept;
  [[nodiscard]] float smoothed(std::span<const float> scores, int u, int v) const noexcept;
  [[nodiscard]] std::int32_t shadow_of(std::size_t side, int u, int v) noexcept;
  [[nodiscard]] bool largest_along(std::size_t side, int u, int v,
                                   std::int32_t shadow) const noexcept;
  void classify() noexcept;
  [[nodiscard]] Vec3f border_direction(int u, int v) const noexcept;
  void average_directions() noexcept;
  void measure_change(int u, int v, double min_change) noexcept;

  const RangeImage* image_ = nullptr;
  BorderParams params_;
  std::span<float> reach_m2_;       ///< squared distance that is still the same surface; < 0: none
  std::span<Vec3f> normal_, mean_;  ///< of the local plane
  std::array<std::span<float>, kSides> score_;
  std::array<std::span<std::int32_t>, kSides> shadow_;
  std::span<float> before_;  ///< scores before smoothing
  std::span<std::uint8_t>
      traits_;  ///< and, while classifying, the obstacle's sides in the high half
  std::span<Vec3f> border_, direction_;
  std::span<float> change_;
};

}  // namespace grapnel
