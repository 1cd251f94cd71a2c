#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/replay/camera_file.h"

namespace grapnel {

/// What a camera.toml says about a sensor's depth being wrong, as tables: the disparity law
/// 1/z' = offset + scale/z, then the grid of multipliers z'' = z' · M(u, v, z'), bilinear between
/// the cells' centres and linear between the distances at which they were measured, level beyond
/// them (as Teichman et al. 2013, CLAMS).
class DepthCorrection {
 public:
  /// Leaves every depth as it is.
  DepthCorrection() = default;
  /// For counts of `metres_per_unit`.
  DepthCorrection(const CameraFile& camera, double metres_per_unit);

  [[nodiscard]] bool empty() const noexcept { return counts_.empty(); }
  /// Floats of working memory that apply() needs.
  [[nodiscard]] std::size_t scratch_floats() const noexcept;
  /// Corrects an image of the camera's size in place; 0 stays "no reading", and a depth that no
  /// longer fits becomes it. Allocates nothing. O(pixels).
  void apply(std::span<std::uint16_t> depth, std::span<float> scratch) const noexcept;

 private:
  /// Where a column or row lies between two cells' centres; beyond the outermost the line goes on.
  struct Place {
    std::size_t cell = 0;
    float weight = 0.0F;  // of the next cell
  };
  static std::vector<Place> places_of(int pixels, int cells);
  void build_counts(const CameraFile& camera, double metres_per_unit);
  void fill_rows(std::size_t v, std::span<float> rows) const noexcept;

  int width_ = 0;
  int height_ = 0;
  std::size_t columns_ = 0;
  std::size_t rows_ = 0;
  std::size_t layers_ = 0;
  std::vector<float> counts_;  // by count: after the law, in counts
  std::vector<Place> layer_;   // by count
  std::vector<Place> column_place_;
  std::vector<Place> row_place_;
  std::vector<float> multipliers_;  // layer, row, column
};

}  // namespace grapnel
