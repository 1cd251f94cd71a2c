#include "pipeline/preprocess/voxel.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/preprocess/compact.h"

namespace grapnel {

FieldTable voxel_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&VoxelParams::leaf_m>("leaf_m", "m", 0.0, 10.0,
                                         "edge of a cell; 0 = finest with at most max_points"),
      number_field<&VoxelParams::max_points>("max_points", "", 10, 1000000,
                                             "points left at most when the leaf is auto"),
  };
  return kFields;
}

namespace {

/// In blocks without a way out, which the compiler makes vectors of.
bool all_zero(std::span<const float> values) noexcept {
  constexpr std::size_t kBlock = 1024;
  for (std::size_t begin = 0; begin < values.size(); begin += kBlock) {
    int set = 0;
    for (const float value : values.subspan(begin, std::min(kBlock, values.size() - begin))) {
      set |= value != 0.0F ? 1 : 0;
    }
    if (set != 0) return false;
  }
  return true;
}

/// Points a cell, in the mean, that make a cloud dense.
constexpr std::size_t kDense = 2;

}  // namespace

void VoxelGrid::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points =
      std::max({limits.max_input_points, limits.max_points, limits.max_model_points});
  cells_.reserve(arena, points);
  count_ = arena.take<std::uint32_t>(points);
  sum_ = arena.take<double>(points);
  max_searched_ = std::max(limits.max_points, limits.max_model_points);
  search_.reserve(arena, max_searched_, 0);
}

double VoxelGrid::leaf_for(const Surface& surface, std::size_t max_points) noexcept {
  double squared = 0.0;
  for (const std::span<float>& plane : {surface.x, surface.y, surface.z}) {
    const auto [low, high] = extent_of(plane.first(surface.size));
    const double extent = static_cast<double>(high) - static_cast<double>(low);
    squared += extent * extent;
  }
  // A surface with the area of its box's diagonal squared; then the counts correct it: they go with
  // the leaf squared.
  const auto wanted = static_cast<double>(max_points);
  double leaf = std::max(std::sqrt(squared / wanted), 1e-9);
  double fits = 0.0;
  for (int round = 0; round < 10; ++round) {
    if (!cells_.number(surface, leaf)) {
      leaf *= 4.0;
      continue;
    }
    const auto cells = static_cast<double>(cells_.cells());
    if (cells <= wanted && (fits == 0.0 || leaf < fits)) fits = leaf;
    if (cells <= wanted && cells >= 0.95 * wanted) break;
    leaf *= std::clamp(std::sqrt(cells / (0.975 * wanted)), 0.25, 4.0);
  }
  while (fits == 0.0) {
    leaf *= 1.25;
    if (cells_.number(surface, leaf) && cells_.cells() <= max_points) fits = leaf;
  }
  return fits;
}

/// One value of each cell; what a cloud does not have (all zero) needs no mean. False then.
bool VoxelGrid::average(std::size_t size, std::span<float> plane) noexcept {
  if (all_zero(plane.first(size))) return false;
  const std::span<const std::uint32_t> cell_of = cells_.cell_of();
  std::fill_n(sum_.begin(), cells_.cells(), 0.0);
  for (std::size_t i = 0; i < size; ++i) sum_[cell_of[i]] += static_cast<double>(plane[i]);
  for (std::size_t cell = 0; cell < cells_.cells(); ++cell) {
    plane[cell] = static_cast<float>(sum_[cell] / static_cast<double>(count_[cell]));
  }
  return true;
}

void VoxelGrid::merge_cells(Surface& surface) noexcept {
  const std::size_t cells = cells_.cells();
  std::fill_n(count_.begin(), cells, 0U);
  for (const std::uint32_t cell : cells_.cell_of()) ++count_[cell];
  for (std::span<float>* plane : {&surface.x, &surface.y, &surface.z, &surface.intensity}) {
    (void)average(surface.size, *plane);
  }
  bool normals = false;
  for (std::span<float>* plane : {&surface.nx, &surface.ny, &surface.nz}) {
    normals |= average(surface.size, *plane);
  }
  surface.size = cells;
  if (!normals) return;
  for (std::size_t i = 0; i < cells; ++i) {
    const float length = surface.normal(i).norm();
    const float scale = length > 0.0F ? 1.0F / length : 0.0F;
    surface.nx[i] *= scale;
    surface.ny[i] *= scale;
    surface.nz[i] *= scale;
  }
}

double VoxelGrid::measured_spacing_m(const Surface& surface, double leaf_m) noexcept {
  constexpr std::size_t kSamples = 500;
  if (surface.size > max_searched_) return 0.0;
  double radius = leaf_m;
  if (radius <= 0.0) {
    // Edge of a cell of a flat square cloud; only a start for the search.
    const Vec3f across = surface.point(surface.size - 1) - surface.point(0);
    radius = static_cast<double>(across.norm()) / std::sqrt(static_cast<double>(surface.size));
  }
  if (!search_.build(surface, std::max(radius, 1e-6)).ok()) return 0.0;
  return mean_spacing_m(search_, surface, kSamples);
}

Result<std::size_t> VoxelGrid::apply(Surface& surface) noexcept {
  return apply(surface, params_.leaf_m, static_cast<std::size_t>(params_.max_points));
}

Result<std::size_t> VoxelGrid::apply(Surface& surface, double leaf_m,
                                     std::size_t max_points) noexcept {
  if (const Status status = check_points(surface, sum_.size(), Stage::Decimate); !status.ok()) {
    return status.error();
  }
  if (leaf_m <= 0.0 && max_points == 0) return Error{Code::BadParameter, Stage::Decimate, 0};
  const std::size_t before = surface.size;
  double leaf = leaf_m;
  if (leaf_m > 0.0 || surface.size > max_points) {
    if (leaf_m <= 0.0) leaf = leaf_for(surface, max_points);
    if (!cells_.number(surface, leaf)) return Error{Code::BadParameter, Stage::Decimate, 1};
    merge_cells(surface);
  }
  drop_grid(surface);
  // Where cells hold several points the cloud is denser than the cells.
  const bool dense = before >= kDense * surface.size;
  surface.spacing_m = dense ? leaf : std::max(leaf, measured_spacing_m(surface, leaf));
  return before - surface.size;
}

}  // namespace grapnel
