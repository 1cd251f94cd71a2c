#include "drivers/replay/depth_correction.h"

#include <algorithm>

namespace grapnel {
namespace {

constexpr std::size_t kCounts = 65536;
constexpr float kLargest = 65535.0F;

}  // namespace

DepthCorrection::DepthCorrection(const CameraFile& camera, double metres_per_unit) {
  if (!camera.corrects_depth()) return;
  width_ = camera.width;
  height_ = camera.height;
  layers_ = camera.grid_distances_m.size();
  columns_ = static_cast<std::size_t>(camera.grid_columns);
  rows_ = static_cast<std::size_t>(camera.grid_rows);
  multipliers_.assign(camera.grid_multipliers.begin(), camera.grid_multipliers.end());
  column_place_ = places_of(width_, camera.grid_columns);
  row_place_ = places_of(height_, camera.grid_rows);
  build_counts(camera, metres_per_unit);
}

std::vector<DepthCorrection::Place> DepthCorrection::places_of(int pixels, int cells) {
  std::vector<Place> places;
  for (int pixel = 0; pixel < pixels && cells > 0; ++pixel) {
    const double at = (pixel + 0.5) * cells / pixels - 0.5;
    const int cell = std::clamp(static_cast<int>(at), 0, std::max(cells - 2, 0));
    places.push_back(
        {static_cast<std::size_t>(cell), cells > 1 ? static_cast<float>(at - cell) : 0.0F});
  }
  return places;
}

void DepthCorrection::build_counts(const CameraFile& camera, double metres_per_unit) {
  counts_.assign(kCounts, 0.0F);
  layer_.assign(kCounts, {});
  const std::vector<double>& law = camera.disparity_law;
  const std::vector<double>& distances = camera.grid_distances_m;
  for (std::size_t count = 1; count < kCounts; ++count) {
    double z = static_cast<double>(count) * metres_per_unit;
    if (!law.empty()) {
      const double disparity = law[0] + law[1] / z;
      if (disparity <= 0.0) continue;  // beyond infinity
      z = 1.0 / disparity;
    }
    counts_[count] = static_cast<float>(z / metres_per_unit);
    std::size_t layer = 0;
    while (layer + 2 < distances.size() && z > distances[layer + 1]) ++layer;
    if (distances.size() < 2) continue;
    const double weight = (z - distances[layer]) / (distances[layer + 1] - distances[layer]);
    layer_[count] = {layer, static_cast<float>(std::clamp(weight, 0.0, 1.0))};
  }
}

std::size_t DepthCorrection::scratch_floats() const noexcept {
  return layers_ * static_cast<std::size_t>(width_);
}

/// The multipliers of image row `v`, layer by layer.
void DepthCorrection::fill_rows(std::size_t v, std::span<float> rows) const noexcept {
  const Place row = row_place_[v];
  for (std::size_t layer = 0; layer < layers_; ++layer) {
    const float* const grid = multipliers_.data() + layer * rows_ * columns_;
    const float* const upper = grid + row.cell * columns_;
    const float* const lower = rows_ > 1 ? upper + columns_ : upper;
    const auto between = [&](std::size_t column) {
      return upper[column] + row.weight * (lower[column] - upper[column]);
    };
    float* const out = rows.data() + layer * static_cast<std::size_t>(width_);
    for (std::size_t u = 0; u < static_cast<std::size_t>(width_); ++u) {
      const Place place = column_place_[u];
      const float left = between(place.cell);
      const float right = columns_ > 1 ? between(place.cell + 1) : left;
      out[u] = left + place.weight * (right - left);
    }
  }
}

void DepthCorrection::apply(std::span<std::uint16_t> depth,
                            std::span<float> scratch) const noexcept {
  if (empty()) return;
  const auto width = static_cast<std::size_t>(width_);
  const std::size_t next = layers_ > 1 ? width : 0;
  for (std::size_t v = 0; v < static_cast<std::size_t>(height_); ++v) {
    if (layers_ > 0) fill_rows(v, scratch);
    std::uint16_t* const row = depth.data() + v * width;
    for (std::size_t u = 0; u < width; ++u) {
      float count = counts_[row[u]];
      if (layers_ > 0) {
        const Place layer = layer_[row[u]];
        const float* const near = scratch.data() + layer.cell * width + u;
        count *= *near + layer.weight * (near[next] - *near);
      }
      count += 0.5F;
      row[u] =
          count < kLargest && count > 0.0F ? static_cast<std::uint16_t>(count) : std::uint16_t{0};
    }
  }
}

}  // namespace grapnel
