#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/keypoints/range_borders.h"
#include "pipeline/keypoints/range_image.h"
#include "pipeline/stage.h"

namespace grapnel {

struct NarfParams {
  Engine engine = Engine::Fast;
  double support_m = 0.0;                ///< what a keypoint covers; 0 = auto: support_ratio
  double support_ratio = 30.0;           ///< × the spacing of the surface
  double min_interest = 0.45;            ///< of a keypoint
  double min_change = 0.2;               ///< surface changes below it do not count
  double optimal_distance_ratio = 0.25;  ///< × support: kept between keypoints and strong changes
  double min_distance_ratio = 0.25;      ///< × support: between two keypoints
  double min_border_probability = 0.8;
  /// Gives what the camera could not see the depth behind it, so that a structured-light camera's
  /// shadows count as borders. PCL: false, which loses them.
  bool fill_shadows = true;
  int max_shadow_px = 40;  ///< a wider gap is taken as far
  /// Looks for a keypoint in an image so coarse that its support is about patch_px wide. PCL's
  /// default: false.
  bool pyramid = true;
  int patch_px = 10;
};

[[nodiscard]] FieldTable narf_fields() noexcept;

/// Keypoints where a surface changes in several directions, at a little distance from the changes
/// themselves (Steder et al. 2011, as PCL's NarfKeypoint with its complete interest image). Works
/// on the camera's grid, or on a view of a cloud. Score = interest, 0…1; scale = support.
class NarfDetector final : public KeypointDetector {
 public:
  explicit NarfDetector(const NarfParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  Status detect(const Surface& surface, KeypointSet& keypoints) noexcept override;

  /// Of the last level looked at, its rows that matter (without pyramid: the whole image).
  [[nodiscard]] const RangeImage& image() const noexcept { return image_; }
  [[nodiscard]] const RangeBorders& borders() const noexcept { return borders_; }
  /// A pixel's interest; the fast engine knows only those of at least min_interest, others may be
  /// 0.
  [[nodiscard]] float interest(std::size_t pixel) const noexcept { return interest_[pixel]; }

 private:
  static constexpr std::size_t kLevels = 8;
  static constexpr std::size_t kCells = 18;  ///< of the histogram of directions, 10 degrees each
  struct Gathered {
    std::array<double, kCells> cells{};
    double negative = 1.0;
  };
  struct View;

  /// Pixels of a level that are scored: their distances, the rows they lie in, how many pixels
  /// their surroundings reach at most, and how many to a change that votes with min_interest.
  struct Served {
    float nearest_m = 0.0F;
    float beyond_m = 0.0F;
    int top = 0;
    int bottom = 0;
    int reach = 2;
    int strong_reach = 2;
    [[nodiscard]] bool holds(const RangeImage& image, std::size_t pixel) const noexcept {
      const float range = image.range[pixel];
      return range >= nearest_m && range < beyond_m && image.valid(pixel);
    }
  };

  [[nodiscard]] std::size_t count_levels() const noexcept;
  void look(const RangeImage& level, double nearest_m, double beyond_m) noexcept;
  void measure(Served& served) const noexcept;
  void score(const Served& served) noexcept;
  [[nodiscard]] double interest_of(int u, int v) noexcept;
  [[nodiscard]] double reach_px(std::size_t pixel) const noexcept;
  template <class Seed>
  void mark_around(int half, const Seed& is_seed, std::span<std::uint8_t> marks) noexcept;
  void flood(const View& view) noexcept;
  [[nodiscard]] kernels::ChangeView votes_of(const View& view) const noexcept;
  [[nodiscard]] double vote(const View& view) noexcept;
  void reach_around(const View& view, int half, std::span<std::uint64_t> reached) const noexcept;
  void gather(const View& view, std::size_t pixel, int distance_px, Gathered& into) const noexcept;
  void add_candidates() noexcept;
  void thin_out(KeypointSet& keypoints) noexcept;

  NarfParams params_;
  double radius_m_ = 0.0;
  std::array<RangeImage, kLevels> levels_;
  RangeImage image_;  ///< in a level's memory
  RangeBorders borders_;
  std::span<float> interest_;
  std::span<std::uint8_t> active_;     ///< 0 calm, 1 changes enough to count, 2 of no surface
  std::span<std::uint8_t> promising_;  ///< a change of min_interest may be within the radius
  std::span<std::int32_t> queue_;
  std::span<std::uint8_t> touched_;
  Gathered gathered_;
  struct Candidate {
    std::int32_t point = -1;
    float interest = 0.0F;
    std::uint32_t order = 0;
    Vec3f place = Vec3f::Zero();
  };
  std::span<Candidate> candidates_;
  std::size_t candidate_count_ = 0;
  bool candidates_full_ = false;
};

}  // namespace grapnel
