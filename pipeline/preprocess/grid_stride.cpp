#include "pipeline/preprocess/grid_stride.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/preprocess/compact.h"

namespace grapnel {
namespace {

constexpr int kMaxSide = 16;

struct Depth {
  float z_m = 0.0F;
  std::int32_t point = -1;
};

/// Point of the median depth in the block whose first pixel is (u0, v0); -1 where it has none.
std::int32_t middle_of_block(const Surface& surface, int u0, int v0, int side) noexcept {
  const Surface::Grid& grid = surface.grid;
  std::array<Depth, kMaxSide * kMaxSide> depths;
  std::size_t count = 0;
  for (int v = v0; v < std::min(grid.height, v0 + side); ++v) {
    for (int u = u0; u < std::min(grid.width, u0 + side); ++u) {
      const std::int32_t point = grid.point_of[static_cast<std::size_t>(v * grid.width + u)];
      if (point >= 0) depths[count++] = {surface.z[static_cast<std::size_t>(point)], point};
    }
  }
  if (count == 0) return -1;
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(depths.begin(), middle, depths.begin() + static_cast<std::ptrdiff_t>(count),
                   [](const Depth& a, const Depth& b) {
                     return a.z_m != b.z_m ? a.z_m < b.z_m : a.point < b.point;
                   });
  return middle->point;
}

}  // namespace

FieldTable grid_stride_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&GridStrideParams::stride>("stride", "px", 1, kMaxSide,
                                              "side of the blocks that leave one point"),
  };
  return kFields;
}

void GridStride::reserve(Arena& arena, const Limits& limits) {
  chosen_ = arena.take<std::int32_t>(std::max(
      {limits.max_input_points, limits.max_points, limits.max_model_points,
       static_cast<std::size_t>(limits.max_width) * static_cast<std::size_t>(limits.max_height)}));
  plane_ = arena.take<float>(
      std::max({limits.max_input_points, limits.max_points, limits.max_model_points}));
}

Result<std::size_t> GridStride::apply(Surface& surface) noexcept {
  if (const Status status = check_points(surface, plane_.size(), Stage::Decimate); !status.ok()) {
    return status.error();
  }
  Surface::Grid& grid = surface.grid;
  if (!surface.organised()) return Error{Code::BadParameter, Stage::Decimate, 0};
  const int side = params_.stride;
  const int width = (grid.width + side - 1) / side;
  const int height = (grid.height + side - 1) / side;
  if (static_cast<std::size_t>(width) * static_cast<std::size_t>(height) > chosen_.size()) {
    return Error{Code::CapacityExceeded, Stage::Decimate, width * height};
  }
  std::size_t block = 0;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      chosen_[block++] = middle_of_block(surface, u * side, v * side, side);
    }
  }
  const std::size_t before = surface.size;
  for (std::span<float>* plane : {&surface.x, &surface.y, &surface.z, &surface.nx, &surface.ny,
                                  &surface.nz, &surface.intensity}) {
    std::size_t k = 0;
    for (std::size_t b = 0; b < block; ++b) {
      if (chosen_[b] >= 0) plane_[k++] = (*plane)[static_cast<std::size_t>(chosen_[b])];
    }
    std::copy_n(plane_.begin(), k, plane->begin());
  }
  std::size_t kept = 0;
  for (std::size_t b = 0; b < block; ++b) {
    grid.point_of[b] = chosen_[b] < 0 ? -1 : static_cast<std::int32_t>(kept);
    if (chosen_[b] >= 0) grid.pixel_of[kept++] = static_cast<std::int32_t>(b);
  }
  surface.size = kept;
  const double shift = 0.5 * (side - 1);
  grid.width = grid.intrinsics.width = width;
  grid.height = grid.intrinsics.height = height;
  grid.intrinsics.fx /= side;
  grid.intrinsics.fy /= side;
  grid.intrinsics.cx = (grid.intrinsics.cx - shift) / side;
  grid.intrinsics.cy = (grid.intrinsics.cy - shift) / side;
  surface.spacing_m *= side;
  return before - kept;
}

}  // namespace grapnel
