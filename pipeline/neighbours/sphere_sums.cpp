#include "pipeline/neighbours/sphere_sums.h"

#include <algorithm>
#include <cmath>

#include "pipeline/neighbours/point_blocks.h"

namespace grapnel {

namespace {

/// Memory for dense pixels per point, border included; sparser grids go point by point.
constexpr std::size_t kPixelsPerPoint = 4;
constexpr std::size_t kMinPixels = 16384;

}  // namespace

void SphereSums::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points = std::max(limits.max_points, limits.max_model_points);
  search_.reserve(arena, limits);
  for (std::span<float>& plane : sums_) plane = arena.take<float>(points + kPadding);
  for (std::span<float>& plane : ordered_) plane = arena.take<float>(points + kernels::kSlack);
  const std::size_t pixels = std::max(kPixelsPerPoint * points, kMinPixels);
  for (std::span<float>& plane : dense_planes_) plane = arena.take<float>(pixels);
}

Status SphereSums::build(const Surface& surface, double radius_m) noexcept {
  surface_ = nullptr;
  if (const Status built = search_.build(surface, radius_m); !built.ok()) return built;
  surface_ = &surface;
  radius_m_ = radius_m;
  dense_ = search_.uses_grid() && spread_out();
  if (dense_) fill_dense();
  return {};
}

/// A neighbour q of p has pixel offsets (du, dv) with
/// |(du, dv)| <= f·r·sqrt(1 + a² + b²) / (z_p - r), where (a, b, 1) is p's ray: from
/// du = f·(dx - a·dz)/z_q and the same for dv. Twice the points' distance from their pixels'
/// centres comes on top. Infinite where the sphere reaches the camera.
double SphereSums::reach_px(std::size_t point_i) const noexcept {
  const double z = static_cast<double>(surface_->z[point_i]);
  if (!(z > radius_m_)) return 1e9;
  const double a = static_cast<double>(surface_->x[point_i]) / z;
  const double b = static_cast<double>(surface_->y[point_i]) / z;
  const double focal = std::max(surface_->grid.intrinsics.fx, surface_->grid.intrinsics.fy);
  return focal * radius_m_ * std::sqrt(1.0 + a * a + b * b) / (z - radius_m_);
}

bool SphereSums::spread_out() noexcept {
  const Surface::Grid& grid = surface_->grid;
  int right = -1;
  left_ = grid.width;
  double reach = 0.0;
  for (std::size_t i = 0; i < surface_->size; ++i) {
    const int u = grid.pixel_of[i] % grid.width;
    left_ = std::min(left_, u);
    right = std::max(right, u);
    reach = std::max(reach, reach_px(i));
  }
  const double slack = 2.0 * search_.grid_slack_px() + 0.01;
  if (!(reach + slack < static_cast<double>(kMaxHalf))) return false;
  border_ = static_cast<int>(std::floor(reach + slack));
  top_ = grid.pixel_of[0] / grid.width;
  height_ = grid.pixel_of[surface_->size - 1] / grid.width - top_ + 1;
  width_ = right - left_ + 1;
  const int block = kernels::kBlock;
  stride_ = (width_ + block - 1) / block * block + 2 * border_ + block;
  const std::ptrdiff_t needed = stride_ * (height_ + 2 * border_ + 1);
  return needed <= static_cast<std::ptrdiff_t>(dense_planes_[0].size());
}

void SphereSums::fill_dense() noexcept {
  const auto used = static_cast<std::size_t>(stride_ * (height_ + 2 * border_ + 1));
  for (std::size_t k = 0; k < dense_planes_.size(); ++k) {
    std::fill_n(dense_planes_[k].begin(), used, k == 0 ? kernels::kNowhere : 0.0F);
  }
  const Surface& s = *surface_;
  for (std::size_t i = 0; i < s.size; ++i) {
    const int u = s.grid.pixel_of[i] % s.grid.width - left_ + border_;
    const int v = s.grid.pixel_of[i] / s.grid.width - top_ + border_;
    const auto at = static_cast<std::size_t>(v * stride_ + u);
    dense_planes_[0][at] = s.x[i];
    dense_planes_[1][at] = s.y[i];
    dense_planes_[2][at] = s.z[i];
    dense_planes_[3][at] = s.nx[i];
    dense_planes_[4][at] = s.ny[i];
    dense_planes_[5][at] = s.nz[i];
    dense_planes_[6][at] = s.has_normal(i) ? 1.0F : 0.0F;
  }
}

kernels::SymmetricPlanes SphereSums::products() const noexcept {
  const auto entry = [&](std::size_t i) { return sums_[kProducts + i].data(); };
  return {entry(0), entry(1), entry(2), entry(3), entry(4), entry(5)};
}

void SphereSums::scatter(bool with_mean) noexcept {
  run(with_mean ? What::ScatterAndMean : What::Scatter);
}

void SphereSums::normals(bool about_own) noexcept {
  run(about_own ? What::NormalsAboutOwn : What::Normals);
}

void SphereSums::run(What what) noexcept {
  if (dense_) {
    over_windows(what);
  } else {
    over_points(what);
  }
}

/// Sums of the points begin…end, which lie in one block of pixels.
void SphereSums::block(What what, std::size_t begin, std::size_t end, int block_u,
                       int row) noexcept {
  double reach = 0.0;
  for (std::size_t i = begin; i < end; ++i) reach = std::max(reach, reach_px(i));
  const double slack = 2.0 * search_.grid_slack_px() + 0.01;
  std::array<std::int16_t, kMaxHalf + 1> half_width{};
  kernels::WindowShape window;
  window.half_height = static_cast<int>(std::floor(reach + slack));
  window.half_width = half_width.data();
  for (int dv = 0; dv <= window.half_height; ++dv) {
    const double down = std::max(0.0, dv - slack);
    const double across = std::sqrt(std::max(0.0, reach * reach - down * down)) + slack;
    half_width[static_cast<std::size_t>(dv)] =
        static_cast<std::int16_t>(std::min(std::floor(across), static_cast<double>(border_)));
  }
  const auto squared = static_cast<float>(radius_m_) * static_cast<float>(radius_m_);
  const std::ptrdiff_t at = (row + border_) * stride_ + block_u + border_;
  const auto& p = dense_planes_;
  const kernels::DensePlanes planes{p[0].data(), p[1].data(), p[2].data(), p[3].data(),
                                    p[4].data(), p[5].data(), p[6].data(), stride_};
  float sums[kernels::kWindowSums][kernels::kBlock];
  if (what == What::Scatter || what == What::ScatterAndMean) {
    kernels::window_scatter(planes, at, window, squared, what == What::ScatterAndMean, sums);
  } else {
    kernels::window_normals(planes, at, window, squared, what == What::NormalsAboutOwn, sums);
  }
  for (std::size_t i = begin; i < end; ++i) {
    const int lane = surface_->grid.pixel_of[i] % surface_->grid.width - left_ - block_u;
    for (std::size_t k = 0; k < kPlanes; ++k) sums_[k][i] = sums[k][lane];
  }
}

void SphereSums::over_windows(What what) noexcept {
  const Surface::Grid& grid = surface_->grid;
  for (std::size_t begin = 0; begin < surface_->size;) {
    const int row = grid.pixel_of[begin] / grid.width;
    const int first_u = grid.pixel_of[begin] % grid.width - left_;
    const int block_u = first_u / kernels::kBlock * kernels::kBlock;
    const std::int32_t behind = row * grid.width + left_ + block_u + kernels::kBlock;
    const std::int32_t limit = std::min(behind, (row + 1) * grid.width);
    std::size_t end = begin + 1;
    while (end < surface_->size && grid.pixel_of[end] < limit) ++end;
    block(what, begin, end, block_u, row - top_);
    begin = end;
  }
}

void SphereSums::over_points(What what) noexcept {
  const Surface& s = *surface_;
  const auto radius = static_cast<float>(radius_m_);
  const bool of_points = what == What::Scatter || what == What::ScatterAndMean;
  if (!of_points) {
    for (std::size_t position = 0; position < s.size; ++position) {
      const std::size_t i = search_.point_at(position);
      ordered_[0][position] = s.nx[i];
      ordered_[1][position] = s.ny[i];
      ordered_[2][position] = s.nz[i];
      ordered_[3][position] = s.has_normal(i) ? 1.0F : 0.0F;
    }
  }
  const kernels::NormalPlanes normals{ordered_[0].data(), ordered_[1].data(), ordered_[2].data(),
                                      ordered_[3].data()};
  PointBlocks blocks(search_.planes(), s.size, radius, dense_planes_);
  for (std::int32_t block_i = 0; block_i < blocks.size(); ++block_i) {
    const kernels::BlockOfPoints block = blocks.block(block_i);
    const std::span<const PointRange> ranges = blocks.near(block_i);
    float sums[kernels::kWindowSums][kernels::kBlock];
    if (of_points) {
      kernels::block_scatter(search_.planes(), block, ranges, radius * radius,
                             what == What::ScatterAndMean, sums);
    } else {
      kernels::block_normals(search_.planes(), normals, block, ranges, radius * radius,
                             what == What::NormalsAboutOwn, sums);
    }
    for (std::int32_t lane = 0; lane < block.count; ++lane) {
      const std::size_t i = search_.point_at(static_cast<std::size_t>(block.first + lane));
      for (std::size_t k = 0; k < kPlanes; ++k) sums_[k][i] = sums[k][lane];
    }
  }
}

}  // namespace grapnel
