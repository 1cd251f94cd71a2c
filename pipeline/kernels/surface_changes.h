#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "pipeline/kernels/range_rows.h"
#include "pipeline/kernels/within.h"

namespace grapnel::kernels {

/// Pixels where a surface changes, row by row, ascending in a row, with kSlack elements behind.
struct ChangePlanes {
  const std::int32_t* u = nullptr;
  const float *x = nullptr, *y = nullptr, *z = nullptr;     ///< place, metres
  const float *dx = nullptr, *dy = nullptr, *dz = nullptr;  ///< direction of the change, unit
  const float* change = nullptr;                            ///< 0…1
};

/// The changes of one row of a view's window, and which of its columns count (bit u - left).
struct ChangeRow {
  PointRange range;
  std::int32_t down = 0;  ///< rows below the view's pixel
  std::uint64_t reached = 0;
};

/// What a pixel's surroundings are seen by: its place, and axes of a picture plane across its ray
/// (see NarfDetector); y of the first axis is zero.
struct ChangeView {
  float x = 0.0F, y = 0.0F, z = 0.0F;
  float across_x = 0.0F, across_z = 0.0F;
  float up_x = 0.0F, up_y = 0.0F, up_z = 0.0F;
  float squared_m2 = 0.0F;    ///< radius squared
  float per_radius = 0.0F;    ///< 1 / radius
  float per_optimal = 0.0F;   ///< radius / optimal distance
  float least = 0.0F;         ///< weaker votes do not count
  std::int32_t u = 0;         ///< the pixel's column
  std::int32_t left = 0;      ///< column of the rows' first bit
  bool every_column = false;  ///< bits are not asked; calm is that of the pixels beside alone
};

/// Directions are counted in cells of 10 degrees.
inline constexpr int kDirectionCells = 18;
struct ChangeVotes {
  float cell[kDirectionCells] = {};  ///< strongest vote of each
  float calm = 1.0F;                 ///< smallest 1 - change · nearness / 2
};

/// Adds the changes within the view's radius, or within two pixels, to the votes. A change votes
/// with itself times 1 - distance / radius, beside the pixel with itself.
void add_votes(const ChangePlanes& changes, std::span<const ChangeRow> rows, const ChangeView& view,
               ChangeVotes& votes) noexcept;

/// Largest root of the product of two cells' votes and the angle between them, 1 at 90 degrees.
[[nodiscard]] float spread_of(const ChangeVotes& votes) noexcept;

/// A window of pixels about one of them, at most 64 columns wide.
struct PixelWindow {
  std::int32_t columns = 0;
  std::int32_t rows = 0;
  std::int32_t centre_column = 0;
  std::int32_t centre_row = 0;
};

/// Which pixels of a window, from `at`, are open (`state` is not 2) and within the sphere, or at
/// most two pixels from the centre: a bit each, a word a row. kSlack elements behind are read.
void open_pixels(const RangePlanes& image, const std::uint8_t* state, std::ptrdiff_t at,
                 const PixelWindow& window, const Sphere& sphere, std::uint64_t* open) noexcept;

}  // namespace grapnel::kernels
