#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "pipeline/kernels/surface_changes.h"
#include "pipeline/keypoints/range_image.h"
#include "pipeline/stage.h"

namespace grapnel {

/// PCL's RangeImageBorderExtractor::Parameters with its defaults.
struct BorderParams {
  int border_radius_px = 3;
  int plane_radius_px = 2;
  int direction_radius_px = 2;
  int curvature_radius_px = 2;
  double min_probability = 0.8;
  Engine engine = Engine::Fast;
  /// 1 for each pixel that is wanted, what surrounds it included; others have no change and no
  /// border. Empty = every pixel.
  std::span<const std::uint8_t> wanted = {};
};

/// Where a range image's surfaces end or bend (Steder et al. 2011, as PCL's
/// RangeImageBorderExtractor): obstacle borders, the shadow borders behind them, veil points
/// between the two, and how much and in which direction the surface changes at each pixel. The
/// reference engine is plain loops in double.
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

  /// The pixels of a surface that change at least as much as extract was told, row by row.
  [[nodiscard]] kernels::ChangePlanes changes() const noexcept;
  /// Those of them that lie in row v, columns `left` to `right`.
  [[nodiscard]] PointRange changes_between(int left, int right, int v) const noexcept {
    return {listed_before_[image_->at(left, v)], listed_before_[image_->at(right, v) + 1]};
  }

 private:
  static constexpr std::uint8_t kObstacle = 1;
  static constexpr std::uint8_t kShadow = 2;
  static constexpr std::uint8_t kVeil = 4;
  static constexpr std::size_t kSides = 4;  ///< left, right, top, bottom

  /// A pixel that may be a border, and how many pixels away each side's shadow begins; 0 = none.
  struct Candidate {
    std::int32_t pixel = -1;
    std::array<std::uint8_t, kSides> shadow{};
  };
  struct BlockSpread;

  [[nodiscard]] bool wanted(std::size_t pixel) const noexcept {
    return params_.wanted.empty() || params_.wanted[pixel] != 0;
  }
  [[nodiscard]] Vec3d normal(std::size_t pixel) const noexcept {
    return Vec3f(normal_[0][pixel], normal_[1][pixel], normal_[2][pixel]).cast<double>();
  }
  [[nodiscard]] kernels::RangePlanes places() const noexcept;
  [[nodiscard]] bool by_blocks() const noexcept;
  /// Calls block(index of its first pixel, u) over a row's pixels; the last one overlaps the one
  /// before. Blocks without a wanted pixel are left out.
  template <class Block>
  void each_block(int v, const Block& block) const noexcept;
  void fit_surfaces() noexcept;
  void fit_block(int u, int v) noexcept;
  void keep_plane(std::size_t pixel, double reach_m2, const Vec3d& mean,
                  const Vec3d& normal) noexcept;
  void fit_surface(int u, int v) noexcept;
  void score_jumps(std::size_t side, int v) noexcept;
  void smooth(std::size_t side, int v) noexcept;
  void measure_changes(double min_change) noexcept;
  void measure_block(std::size_t first, double min_change) noexcept;
  [[nodiscard]] float distance_change(int u, int v, int du, int dv, int radius) const noexcept;
  void score_borders() noexcept;
  [[nodiscard]] float smoothed(std::span<const float> scores, int u, int v) const noexcept;
  [[nodiscard]] int shadow_of(std::size_t side, int u, int v) noexcept;
  [[nodiscard]] bool largest_along(std::size_t side, int u, int v, int shadow) const noexcept;
  void list_candidates() noexcept;
  void classify() noexcept;
  [[nodiscard]] Vec3f border_direction(std::size_t pixel) const noexcept;
  void average_directions() noexcept;
  void measure_change(int u, int v, double min_change) noexcept;
  void list_changes(double min_change) noexcept;

  const RangeImage* image_ = nullptr;
  BorderParams params_;
  std::span<float> reach_m2_;  ///< squared distance that is still the same surface; < 0: none
  std::array<std::span<float>, 3> normal_;  ///< x, y, z of the local plane's
  std::array<std::span<float>, 3> mean_;    ///< of the local plane's points, less the pixel's own
  std::span<float> code_;                   ///< see kernels::beam_spread
  std::array<std::span<float>, kSides> score_;
  std::span<float> before_;  ///< scores before smoothing
  std::span<Candidate> candidates_;
  std::size_t candidate_count_ = 0;
  std::span<std::uint8_t>
      traits_;               ///< and, while classifying, the obstacle's sides in the high half
  std::span<Vec3f> border_;  ///< of obstacles only
  std::span<Vec3f> direction_;
  std::span<float> change_;
  /// The changes' columns; mean_ has their places then, score_ directions, before_ strengths.
  std::span<std::int32_t> column_;
  std::span<std::int32_t> listed_before_;  ///< number of changes before each pixel, one more behind
};

template <class Block>
void RangeBorders::each_block(int v, const Block& block) const noexcept {
  const int last = image_->width - kernels::kRangeBlock;
  for (int u = 0; u < image_->width; u += kernels::kRangeBlock) {
    const int from = std::min(u, last);
    const std::size_t at = image_->at(from, v);
    if (!params_.wanted.empty()) {
      const auto first = params_.wanted.begin() + static_cast<std::ptrdiff_t>(at);
      if (std::find(first, first + kernels::kRangeBlock, 1) == first + kernels::kRangeBlock) {
        continue;
      }
    }
    block(static_cast<std::ptrdiff_t>(at), from);
  }
}

}  // namespace grapnel
