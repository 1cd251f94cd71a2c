#include "pipeline/preprocess/voxel_covariance.h"

#include <algorithm>
#include <array>

#include "pipeline/preprocess/compact.h"

namespace grapnel {
namespace {

/// Second eigenvalue to largest below which a cell is a line and has no normal.
constexpr double kLineRatio = 1e-4;

Symmetric3 symmetric(const Mat3d& m) noexcept {
  return {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)};
}

/// Eigenvalues below `ratio` of the largest raised to it.
Symmetric3 rounded(const Eigen3& eigen, double ratio) noexcept {
  const Vec3d values = eigen.values.cwiseMax(ratio * eigen.values[2]);
  return symmetric(eigen.vectors * values.asDiagonal() * eigen.vectors.transpose());
}

}  // namespace

FieldTable voxel_covariance_fields() noexcept {
  using P = VoxelCovarianceParams;
  static constexpr std::array kFields = {
      number_field<&P::leaf_m>("leaf_m", "m", 1e-5, 10.0, "edge of a cell"),
      number_field<&P::min_points>("min_points", "", 3, 100000, "of a cell; fewer give nothing"),
      number_field<&P::min_eigenvalue_ratio>(
          "min_eigenvalue_ratio", "", 0.0, 1.0,
          "eigenvalues of a covariance below this share of the largest are raised to it"),
  };
  return kFields;
}

void VoxelCovariance::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points =
      std::max({limits.max_input_points, limits.max_points, limits.max_model_points});
  max_points_ = points;
  cells_.reserve(arena, points);
  // A cell holds three points at least.
  found_ = arena.take<Cell>(points / 3 + 1);
  memory_ = arena.take<Symmetric3>(points / 3 + 1);
  covariances_ = {};
}

bool VoxelCovariance::measure(const Surface& surface, std::span<const std::uint64_t> points,
                              Cell& cell, Symmetric3& covariance) const noexcept {
  const auto count = static_cast<double>(points.size());
  Vec3d mean = Vec3d::Zero();
  double intensity = 0.0;
  for (const std::uint64_t i : points) {
    mean += surface.point(i).cast<double>();
    intensity += static_cast<double>(surface.intensity[i]);
  }
  mean /= count;
  Symmetric3 sum;
  for (const std::uint64_t i : points) {
    const Vec3d d = surface.point(i).cast<double>() - mean;
    sum.add(d.x(), d.y(), d.z());
  }
  const Eigen3 eigen = eigen_symmetric3(sum.over(count - 1.0));
  if (!(eigen.values[2] > 0.0)) return false;
  covariance = rounded(eigen, params_.min_eigenvalue_ratio);
  cell = {mean.cast<float>(), Vec3f::Zero(), static_cast<float>(intensity / count)};
  if (eigen.values[1] > kLineRatio * eigen.values[2]) {
    cell.normal = eigen.vectors.col(0).cast<float>();
  }
  return true;
}

Result<std::size_t> VoxelCovariance::apply(Surface& surface) noexcept {
  if (const Status status = check_points(surface, max_points_, Stage::Decimate); !status.ok()) {
    return status.error();
  }
  if (!cells_.sort(surface, params_.leaf_m)) return Error{Code::BadParameter, Stage::Decimate, 1};
  const auto needed = static_cast<std::size_t>(params_.min_points);
  std::size_t count = 0;
  for (std::size_t cell = 0; cell < cells_.cells(); ++cell) {
    const std::span<const std::uint64_t> points = cells_.points_of(cell);
    if (points.size() < needed) continue;
    if (measure(surface, points, found_[count], memory_[count])) ++count;
  }
  if (count == 0) return Error{Code::TooFewPoints, Stage::Decimate, 0};
  const std::size_t before = surface.size;
  const Vec3f middle =
      surface.has_viewpoint ? surface.viewpoint : Vec3f(centroid(surface).cast<float>());
  for (std::size_t i = 0; i < count; ++i) {
    const Cell& cell = found_[i];
    const float toward = cell.normal.dot(middle - cell.mean);
    const bool turn = surface.has_viewpoint ? toward < 0.0F : toward > 0.0F;
    const Vec3f normal = turn ? Vec3f(-cell.normal) : cell.normal;
    surface.x[i] = cell.mean.x();
    surface.y[i] = cell.mean.y();
    surface.z[i] = cell.mean.z();
    surface.nx[i] = normal.x();
    surface.ny[i] = normal.y();
    surface.nz[i] = normal.z();
    surface.intensity[i] = cell.intensity;
  }
  surface.size = count;
  surface.spacing_m = params_.leaf_m;
  drop_grid(surface);
  covariances_ = memory_.first(count);
  return before - count;
}

}  // namespace grapnel
