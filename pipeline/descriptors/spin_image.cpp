#include "pipeline/descriptors/spin_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "base/math.h"
#include "pipeline/descriptors/common.h"

namespace grapnel {

FieldTable spin_image_fields() noexcept {
  using P = SpinImageParams;
  static constexpr std::array<std::string_view, 2> kStructures = {"rectangular", "radial"};
  static constexpr std::array<std::string_view, 2> kDomains = {"density", "angular"};
  static constexpr std::array kFields = {
      number_field<&P::radius_m>("radius_m", "m", 0.0, 10.0,
                                 "described surroundings; 0 = radius_ratio spacings"),
      number_field<&P::radius_ratio>("radius_ratio", "", 1.0, 100.0,
                                     "described surroundings in spacings"),
      number_field<&P::width>("width", "cells", 1, 16, "image of width + 1 × 2 width + 1"),
      choice_field<&P::structure>("structure", kStructures,
                                  "distances from and along the normal, or distance and elevation"),
      choice_field<&P::domain>("domain", kDomains, "share of votes, or mean angle of normals"),
      number_field<&P::min_cos>("min_cos", "", 0.0, 1.0,
                                "neighbours whose normal leans farther are left out; 0 = none"),
      number_field<&P::min_neighbours>("min_neighbours", "", 0, 100000,
                                       "a keypoint with fewer is not described"),
      number_field<&P::max_neighbours>(
          "max_neighbours", "", 0, 100000,
          "of one keypoint, thinned evenly beyond; 0 = the preset's limit (PCL: no limit)"),
      choice_field<&P::engine>("engine", kEngineNames, "fast, or plain loops in double"),
  };
  return kFields;
}

std::size_t SpinImageEstimator::dimension() const noexcept {
  const auto width = static_cast<std::size_t>(params_.width);
  return (width + 1) * (2 * width + 1);
}

void SpinImageEstimator::reserve(Arena& arena, const Limits& limits) {
  max_neighbours_ = params_.max_neighbours > 0 ? static_cast<std::size_t>(params_.max_neighbours)
                                               : limits.max_neighbours;
  search_.reserve(arena, limits);
  others_ = arena.take<std::int32_t>(max_neighbours_);
  cells_ = arena.take<std::int32_t>(max_neighbours_ + 8);
  for (std::span<float>* list : {&to_next_row_, &to_next_column_, &angle_rad_}) {
    *list = arena.take<float>(max_neighbours_ + 8);
  }
  for (std::span<float>* image : {&votes_, &angles_}) *image = arena.take<float>(dimension());
  for (std::span<double>* image : {&plain_votes_, &plain_angles_}) {
    *image = arena.take<double>(dimension());
  }
}

std::size_t SpinImageEstimator::gather(const Surface& surface,
                                       const Neighbourhood& around) noexcept {
  std::size_t count = 0;
  for (const std::int32_t index : around.index) {
    if (uses_normals() && !surface.has_normal(static_cast<std::size_t>(index))) continue;
    others_[count++] = index;
  }
  return count;
}

template <class Real>
void SpinImageEstimator::add_vote(std::span<Real> votes, std::span<Real> angles, std::size_t cell,
                                  Real to_next_row, Real to_next_column,
                                  Real angle_rad) const noexcept {
  const std::size_t below = cell + 2 * static_cast<std::size_t>(params_.width) + 1;
  const Real here = 1 - to_next_row;
  const std::array<std::pair<std::size_t, Real>, 4> shares = {{
      {cell, here * (1 - to_next_column)},
      {below, to_next_row * (1 - to_next_column)},
      {cell + 1, here * to_next_column},
      {below + 1, to_next_row * to_next_column},
  }};
  for (const auto& [at, share] : shares) votes[at] += share;
  if (params_.domain == SpinDomain::Density) return;
  for (const auto& [at, share] : shares) angles[at] += share * angle_rad;
}

void SpinImageEstimator::vote_fast(const Surface& surface, std::size_t point_i, double radius_m,
                                   std::size_t count) noexcept {
  const bool radial = params_.structure == SpinStructure::Radial;
  kernels::SpinFrame frame;
  frame.x = surface.x[point_i];
  frame.y = surface.y[point_i];
  frame.z = surface.z[point_i];
  frame.nx = surface.nx[point_i];
  frame.ny = surface.ny[point_i];
  frame.nz = surface.nz[point_i];
  frame.min_cos = static_cast<float>(params_.min_cos);
  frame.cell_m = static_cast<float>(radius_m / params_.width / (radial ? 1.0 : std::sqrt(2.0)));
  frame.width = params_.width;
  frame.radial = radial;
  frame.angular = params_.domain == SpinDomain::Angular;
  const kernels::OrientedPlanes points{surface.x.data(),  surface.y.data(),  surface.z.data(),
                                       surface.nx.data(), surface.ny.data(), surface.nz.data()};
  const kernels::SpinVotes votes{cells_.data(), to_next_row_.data(), to_next_column_.data(),
                                 angle_rad_.data()};
  kernels::spin_votes(points, frame, others_.first(count), votes);
  std::ranges::fill(votes_, 0.0F);
  std::ranges::fill(angles_, 0.0F);
  for (std::size_t i = 0; i < count; ++i) {
    if (cells_[i] < 0) continue;
    add_vote(votes_, angles_, static_cast<std::size_t>(cells_[i]), to_next_row_[i],
             to_next_column_[i], angle_rad_[i]);
  }
}

void SpinImageEstimator::vote_plain(const Surface& surface, std::size_t point_i, double radius_m,
                                    std::size_t count) noexcept {
  const bool radial = params_.structure == SpinStructure::Radial;
  const double width = params_.width;
  const double cell_m = radius_m / width / (radial ? 1.0 : std::sqrt(2.0));
  const Vec3d place = surface.point(point_i).cast<double>();
  const Vec3d axis = surface.normal(point_i).cast<double>();
  std::ranges::fill(plain_votes_, 0.0);
  std::ranges::fill(plain_angles_, 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    const auto other = static_cast<std::size_t>(others_[i]);
    double angle_rad = 0.0;
    if (uses_normals()) {
      const double cos_normals =
          std::min(std::fabs(axis.dot(surface.normal(other).cast<double>())), 1.0);
      if (cos_normals < params_.min_cos) continue;
      angle_rad = math::acos(cos_normals);
    }
    const Vec3d line = surface.point(other).cast<double>() - place;
    const double length = line.norm();
    if (length == 0.0) continue;
    const double sine = std::clamp(line.dot(axis) / length, -1.0, 1.0);
    double row = length / cell_m;
    double column = (0.5 * math::kPi - math::acos(sine)) * width / (0.5 * math::kPi);
    if (!radial) {
      column = row * sine;
      row *= std::sqrt(1.0 - sine * sine);
      if (std::fabs(column) >= width || row >= width) continue;
    }
    const double row_cell = std::min(std::floor(row), width - 1.0);
    const double column_cell = std::min(std::floor(column + width), 2.0 * width - 1.0);
    const auto cell = static_cast<std::size_t>(row_cell * (2.0 * width + 1.0) + column_cell);
    add_vote(plain_votes_, plain_angles_, cell, std::min(row - row_cell, 1.0),
             std::min(column + width - column_cell, 1.0), angle_rad);
  }
}

template <class Real>
void SpinImageEstimator::finish(std::span<const Real> votes, std::span<const Real> angles,
                                std::span<float> row) const noexcept {
  if (params_.domain == SpinDomain::Angular) {
    // PCL's own guard against empty cells.
    constexpr Real kEpsilon = static_cast<Real>(std::numeric_limits<double>::epsilon());
    for (std::size_t i = 0; i < row.size(); ++i) {
      row[i] = static_cast<float>(angles[i] / (votes[i] + kEpsilon));
    }
    return;
  }
  double sum = 0.0;
  for (const Real vote : votes) sum += static_cast<double>(vote);
  if (sum == 0.0) return;
  for (std::size_t i = 0; i < row.size(); ++i) {
    row[i] = static_cast<float>(static_cast<double>(votes[i]) / sum);
  }
}

Status SpinImageEstimator::describe(const Surface& surface, std::span<const Keypoint> keypoints,
                                    FeatureMatrix& features) noexcept {
  const Result<float> radius_m = begin_description(
      surface, keypoints, params_.radius_m, params_.radius_ratio, dimension(), features, search_);
  if (!radius_m.ok()) return radius_m.error();
  const auto radius = static_cast<double>(radius_m.value());
  for (std::size_t k = 0; k < keypoints.size(); ++k) {
    const auto point_i = static_cast<std::size_t>(keypoints[k].point);
    if (!surface.has_normal(point_i)) continue;
    const Neighbourhood around = search_.within(point_i, radius_m.value());
    if (around.size() < params_.min_neighbours) continue;
    const std::size_t count = gather(surface, search_.thin(around, max_neighbours_));
    if (count == 0) continue;
    if (params_.engine == Engine::Fast) {
      vote_fast(surface, point_i, radius, count);
      finish<float>(votes_, angles_, features.row(k));
    } else {
      vote_plain(surface, point_i, radius, count);
      finish<double>(plain_votes_, plain_angles_, features.row(k));
    }
  }
  return {};
}

}  // namespace grapnel
