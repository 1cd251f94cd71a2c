#include "pipeline/preprocess/voxel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

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

/// 21 bits an axis in one key.
constexpr double kMaxCells = 2097152.0;
constexpr std::uint32_t kDigits = 2048;

}  // namespace

void VoxelGrid::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points =
      std::max({limits.max_input_points, limits.max_points, limits.max_model_points});
  key_ = arena.take<std::uint64_t>(points);
  other_key_ = arena.take<std::uint64_t>(points);
  order_ = arena.take<std::int32_t>(points);
  other_order_ = arena.take<std::int32_t>(points);
  plane_ = arena.take<float>(points);
  max_searched_ = std::max(limits.max_points, limits.max_model_points);
  search_.reserve(arena, max_searched_, 0);
}

/// Fills key_ with packed cells (z high, x low) and order_ with the points sorted by them, ties by
/// index. False when the cloud spans more cells than a key holds.
bool VoxelGrid::sort_by_cell(const Surface& surface, double leaf_m) noexcept {
  const std::array<std::span<float>, 3> planes = {surface.x, surface.y, surface.z};
  // In float, as PCL: the cell of a point on a border depends on it.
  const auto inverse = static_cast<float>(1.0 / leaf_m);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::span<const float> plane = planes[axis].first(surface.size);
    const auto [low, high] = std::minmax_element(plane.begin(), plane.end());
    const double first = std::floor(static_cast<double>(*low * inverse));
    const double last = std::floor(static_cast<double>(*high * inverse));
    if (!(last - first < kMaxCells)) return false;
    for (std::size_t i = 0; i < surface.size; ++i) {
      const double cell = std::floor(static_cast<double>(plane[i] * inverse)) - first;
      const std::uint64_t bits = static_cast<std::uint64_t>(cell) << (21 * axis);
      key_[i] = axis == 0 ? bits : key_[i] | bits;
    }
  }
  for (std::size_t i = 0; i < surface.size; ++i) order_[i] = static_cast<std::int32_t>(i);

  std::uint64_t varying = 0;
  for (std::size_t i = 1; i < surface.size; ++i) varying |= key_[i] ^ key_[0];
  for (unsigned shift = 0; shift < 63; shift += 11) {
    if (((varying >> shift) & (kDigits - 1)) == 0) continue;
    std::array<std::uint32_t, kDigits + 1> begin{};
    for (std::size_t i = 0; i < surface.size; ++i) {
      ++begin[((key_[i] >> shift) & (kDigits - 1)) + 1];
    }
    for (std::size_t digit = 0; digit < kDigits; ++digit) begin[digit + 1] += begin[digit];
    for (std::size_t i = 0; i < surface.size; ++i) {
      const std::uint32_t to = begin[(key_[i] >> shift) & (kDigits - 1)]++;
      other_key_[to] = key_[i];
      other_order_[to] = order_[i];
    }
    std::swap(key_, other_key_);
    std::swap(order_, other_order_);
  }
  return true;
}

std::size_t VoxelGrid::occupied_cells(std::size_t size) const noexcept {
  std::size_t cells = size > 0 ? 1 : 0;
  for (std::size_t i = 1; i < size; ++i) cells += key_[i] != key_[i - 1] ? 1U : 0U;
  return cells;
}

double VoxelGrid::leaf_for(const Surface& surface, std::size_t max_points) noexcept {
  double squared = 0.0;
  for (const std::span<float>& plane : {surface.x, surface.y, surface.z}) {
    const auto [low, high] = std::minmax_element(
        plane.begin(), plane.begin() + static_cast<std::ptrdiff_t>(surface.size));
    const double extent = static_cast<double>(*high) - static_cast<double>(*low);
    squared += extent * extent;
  }
  // A surface with the area of its box's diagonal squared; then the counts correct it: they go with
  // the leaf squared.
  const auto wanted = static_cast<double>(max_points);
  double leaf = std::max(std::sqrt(squared / wanted), 1e-9);
  double fits = 0.0;
  for (int round = 0; round < 10; ++round) {
    if (!sort_by_cell(surface, leaf)) {
      leaf *= 4.0;
      continue;
    }
    const auto cells = static_cast<double>(occupied_cells(surface.size));
    if (cells <= wanted && (fits == 0.0 || leaf < fits)) fits = leaf;
    if (cells <= wanted && cells >= 0.95 * wanted) break;
    leaf *= std::clamp(std::sqrt(cells / (0.975 * wanted)), 0.25, 4.0);
  }
  while (fits == 0.0) {
    leaf *= 1.25;
    if (sort_by_cell(surface, leaf) && occupied_cells(surface.size) <= max_points) fits = leaf;
  }
  return fits;
}

void VoxelGrid::merge_cells(Surface& surface) noexcept {
  // Runs of equal keys; order_ and key_ keep (first position) → (end position).
  std::size_t cells = 0;
  for (std::size_t begin = 0; begin < surface.size;) {
    std::size_t end = begin + 1;
    while (end < surface.size && key_[end] == key_[begin]) ++end;
    other_order_[cells] = static_cast<std::int32_t>(begin);
    other_key_[cells++] = end;
    begin = end;
  }
  for (std::span<float>* plane : {&surface.x, &surface.y, &surface.z, &surface.nx, &surface.ny,
                                  &surface.nz, &surface.intensity}) {
    for (std::size_t cell = 0; cell < cells; ++cell) {
      const auto begin = static_cast<std::size_t>(other_order_[cell]);
      const auto end = static_cast<std::size_t>(other_key_[cell]);
      double sum = 0.0;
      for (std::size_t i = begin; i < end; ++i) {
        sum += static_cast<double>((*plane)[static_cast<std::size_t>(order_[i])]);
      }
      plane_[cell] = static_cast<float>(sum / static_cast<double>(end - begin));
    }
    std::copy_n(plane_.begin(), cells, plane->begin());
  }
  surface.size = cells;
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
  if (surface.size == 0) return Error{Code::TooFewPoints, Stage::Decimate, 0};
  if (surface.size > key_.size()) {
    return Error{Code::CapacityExceeded, Stage::Decimate, static_cast<std::int32_t>(surface.size)};
  }
  if (leaf_m <= 0.0 && max_points == 0) return Error{Code::BadParameter, Stage::Decimate, 0};
  const std::size_t before = surface.size;
  double leaf = leaf_m;
  if (leaf_m > 0.0 || surface.size > max_points) {
    if (leaf_m <= 0.0) leaf = leaf_for(surface, max_points);
    if (!sort_by_cell(surface, leaf)) return Error{Code::BadParameter, Stage::Decimate, 1};
    merge_cells(surface);
  }
  drop_grid(surface);
  surface.spacing_m = std::max(leaf, measured_spacing_m(surface, leaf));
  return before - surface.size;
}

}  // namespace grapnel
