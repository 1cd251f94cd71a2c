#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/arena.h"
#include "base/field.h"
#include "base/rng.h"
#include "pipeline/belt_background.h"
#include "pipeline/limits.h"
#include "pipeline/preprocess/plane_search.h"
#include "pipeline/preprocess/row_bands.h"
#include "pipeline/preprocess/working_depth.h"

namespace grapnel {

/// Auto: the taught image where there is one, else the taught plane, else the frame's own dominant
/// planes.
enum class BackgroundMethod : std::uint8_t { Off, Auto, Image, Plane, Dominant };

struct BackgroundParams {
  BackgroundMethod method = BackgroundMethod::Auto;
  double sigmas = 3.0;           ///< of depth noise that a reading must stand above the background
  double sigma_1m_m = 0.001425;  ///< axial noise at 1 m, growing with z²
  double min_height_m = 0.0;     ///< above the background; 0 = auto: min_height_ratio
  double min_height_ratio =
      0.008;           ///< of the background's distance: bow and wear of sensor and belt
  int max_planes = 2;  ///< dominant planes removed one after the other (table, wall)
  PlaneSearchParams search;
};

[[nodiscard]] FieldTable background_fields() noexcept;

/// What was taken for background.
struct BackgroundReport {
  BackgroundMethod used = BackgroundMethod::Off;  ///< Off: nothing was known or found
  std::size_t foreground = 0;                     ///< pixels left
  std::size_t removed = 0;
  std::array<DepthPlane, 4> planes{};  ///< the belt's first, where one is known
  std::size_t plane_count = 0;
};

/// Sets the label of every pixel that does not stand above the background to kNoLabel; its depth
/// stays.
class BackgroundRemoval {
 public:
  explicit BackgroundRemoval(const BackgroundParams& params) noexcept
      : params_(params), search_(params.search) {}

  void reserve(Arena& arena, const Limits& limits);
  /// `min_extent_m`: a plane smaller than this both ways is a part's own face and stays; 0 = any.
  BackgroundReport apply(WorkingDepth& work, const BeltBackground& belt, double min_extent_m,
                         Rng& rng) noexcept;

  /// Labels the pixels of the bands anew, by what `report` took for background: their readings have
  /// changed since. Brings its counts up to date.
  void apply_again(WorkingDepth& work, const BeltBackground& belt, const RowBands& bands,
                   BackgroundReport& report) const noexcept;

 private:
  void remove_image(WorkingDepth& work, const BeltBackground& belt,
                    const RowBands& bands) const noexcept;
  void remove_plane(WorkingDepth& work, const DepthPlane& plane,
                    const RowBands& bands) const noexcept;

  BackgroundParams params_;
  PlaneSearch search_;
  RowBands all_;
};

}  // namespace grapnel
