#include "pipeline/preprocess/plane_normals.h"

#include <algorithm>
#include <array>

#include "pipeline/kernels/plane_fit.h"

namespace grapnel {
namespace {

constexpr int kReach = kernels::kFitReach;

std::size_t stride_of(int width) noexcept {
  return static_cast<std::size_t>(width + 2 * kReach) + kernels::kLanes;
}

std::size_t room_for(int width, int height) noexcept {
  return stride_of(width) * static_cast<std::size_t>(height + 2 * kReach) + kernels::kLanes;
}

}  // namespace

FieldTable plane_normals_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&PlaneNormalsParams::max_step_ratio>(
          "max_step_ratio", "", 1e-4, 10.0,
          "span of the depths of 5 × 5 pixels over their mean that is a step"),
  };
  return kFields;
}

void PlaneNormals::reserve(Arena& arena, const Limits& limits) {
  inverse_m_ = arena.take<float>(std::max(room_for(limits.max_width, limits.max_height),
                                          room_for(limits.max_height, limits.max_width)));
  const std::size_t row =
      kernels::in_lanes(static_cast<std::size_t>(std::max(limits.max_width, limits.max_height)));
  for (std::span<float>* plane : {&nx_, &ny_, &nz_}) *plane = arena.take<float>(row);
}

Status PlaneNormals::estimate(Surface& surface) noexcept {
  const Surface::Grid& grid = surface.grid;
  if (surface.size == 0) return Error{Code::TooFewPoints, Stage::Normals, 0};
  if (!surface.organised() || !(grid.intrinsics.fx > 0.0) || !(grid.intrinsics.fy > 0.0)) {
    return Error{Code::BadParameter, Stage::Normals, 0};
  }
  const std::size_t filled = room_for(grid.width, grid.height);
  if (filled > inverse_m_.size() || static_cast<std::size_t>(grid.width) > nx_.size()) {
    return Error{Code::CapacityExceeded, Stage::Normals, grid.width};
  }
  const std::size_t stride = stride_of(grid.width);
  const std::size_t origin = kReach * stride + kReach;
  std::fill_n(inverse_m_.begin(), filled, 0.0F);
  std::size_t pixel = 0;
  for (int v = 0; v < grid.height; ++v) {
    float* row = inverse_m_.data() + origin + static_cast<std::size_t>(v) * stride;
    for (int u = 0; u < grid.width; ++u, ++pixel) {
      if (grid.point_of[pixel] < 0) continue;
      const float z = surface.z[static_cast<std::size_t>(grid.point_of[pixel])];
      if (!(z > 0.0F)) return Error{Code::BadParameter, Stage::Normals, grid.point_of[pixel]};
      row[u] = 1.0F / z;
    }
  }
  kernels::FitRow fit;
  fit.stride = static_cast<std::ptrdiff_t>(stride);
  fit.first_u = static_cast<float>(-grid.intrinsics.cx);
  fit.fx = static_cast<float>(grid.intrinsics.fx);
  fit.fy = static_cast<float>(grid.intrinsics.fy);
  fit.max_step = static_cast<float>(params_.max_step_ratio);
  pixel = 0;
  for (int v = 0; v < grid.height; ++v) {
    fit.inverse_m = inverse_m_.data() + origin + static_cast<std::size_t>(v) * stride;
    fit.v = static_cast<float>(v - grid.intrinsics.cy);
    kernels::fit_planes(fit, static_cast<std::size_t>(grid.width), nx_.data(), ny_.data(),
                        nz_.data());
    for (int u = 0; u < grid.width; ++u, ++pixel) {
      if (grid.point_of[pixel] < 0) continue;
      const auto i = static_cast<std::size_t>(grid.point_of[pixel]);
      const auto k = static_cast<std::size_t>(u);
      surface.nx[i] = nx_[k];
      surface.ny[i] = ny_[k];
      surface.nz[i] = nz_[k];
    }
  }
  return {};
}

}  // namespace grapnel
