// Local planes of a range image and how their normals spread: the fast engine in blocks of a row,
// the reference engine and the image's rim pixel by pixel.
#include <algorithm>
#include <cmath>

#include "pipeline/keypoints/range_borders.h"
#include "pipeline/neighbours/symmetric3.h"

namespace grapnel {

namespace {

constexpr int kMaxPlaneRadius = 4;
constexpr std::size_t kMaxPatch =
    static_cast<std::size_t>((2 * kMaxPlaneRadius + 1) * (2 * kMaxPlaneRadius + 1));

/// Eigenvector of the largest eigenvalue.
Vec3d largest_eigenvector(const Symmetric3& m) noexcept {
  // The largest of m is the smallest of trace·I - m.
  const double trace = m.xx + m.yy + m.zz;
  const Symmetric3 rest = {trace - m.xx, -m.xy, -m.xz, trace - m.yy, -m.yz, trace - m.zz};
  return smallest_eigenvector(rest, eigenvalues_symmetric3(rest));
}

/// Fewer valid pixels than the nine that are looked for.
constexpr float kTooFew_m2 = 1e29F;

}  // namespace

kernels::RangePlanes RangeBorders::places() const noexcept {
  return {image_->x.data(), image_->y.data(), image_->z.data(), image_->width};
}

kernels::Spread RangeBorders::spread_at(int u) const noexcept {
  const auto row = [&](std::size_t i) { return row_[i].data() + u; };
  return {row(0), row(1), row(2), row(3), row(4), row(5), row(6), row(7), row(8)};
}

kernels::SymmetricPlanes RangeBorders::spread_rows() const noexcept {
  const auto row = [&](std::size_t i) { return row_[i].data() + kernels::kRangeReach; };
  return {row(0), row(1), row(2), row(3), row(4), row(5)};
}

/// Whether a row's inner pixels are worked on in blocks: `reach` rows above and below are there.
bool RangeBorders::by_blocks(int v, int reach) const noexcept {
  return params_.engine == Engine::Fast && v >= reach && v < image_->height - reach &&
         image_->width >= kernels::kRangeBlock + 2 * kernels::kRangeReach;
}

/// The normal is turned toward the camera.
void RangeBorders::keep_plane(std::size_t pixel, double reach_m2, const Vec3d& mean,
                              const Vec3d& normal) noexcept {
  const Vec3d own = image_->place(pixel);
  const double sign = normal.dot(own) > 0.0 ? -1.0 : 1.0;
  reach_m2_[pixel] = static_cast<float>(reach_m2);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    normal_[axis][pixel] = static_cast<float>(sign * normal[static_cast<Eigen::Index>(axis)]);
  }
  mean_[pixel] = (own + mean).cast<float>();
}

/// Plane through the patch's points that lie on the pixel's own surface: nearer than twice the
/// distance of as many nearest points as half the patch's edge squared holds (9 of 25).
void RangeBorders::fit_surface(int u, int v) noexcept {
  const RangeImage& image = *image_;
  const std::size_t pixel = image.at(u, v);
  reach_m2_[pixel] = -1.0F;
  if (!image.valid(pixel) || !wanted(pixel)) return;
  const int radius = std::min(params_.plane_radius_px, kMaxPlaneRadius);
  const int step = std::max(1, radius / 2);
  const auto edge = static_cast<std::size_t>(radius / step + 1);
  const Vec3d own = image.place(pixel);
  std::array<double, kMaxPatch> squared{};
  std::array<double, kMaxPatch> ordered{};
  std::array<Vec3d, kMaxPatch> offset;
  std::size_t count = 0;
  for (int v2 = v - radius; v2 <= v + radius; v2 += step) {
    for (int u2 = u - radius; u2 <= u + radius; u2 += step) {
      if (!image.valid(u2, v2)) continue;
      offset[count] = image.place(image.at(u2, v2)) - own;
      squared[count] = offset[count].squaredNorm();
      ordered[count] = squared[count];
      ++count;
    }
  }
  const std::size_t nearest = std::min(count, edge * edge);
  const auto middle = ordered.begin() + static_cast<std::ptrdiff_t>(nearest - 1);
  std::nth_element(ordered.begin(), middle, ordered.begin() + static_cast<std::ptrdiff_t>(count));
  Symmetric3 sum;
  Vec3d mean = Vec3d::Zero();
  double used = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    if (squared[i] > 4.0 * *middle) continue;
    sum.add(offset[i].x(), offset[i].y(), offset[i].z());
    mean += offset[i];
    used += 1.0;
  }
  if (used < 3.0) return;
  mean /= used;
  const Symmetric3 spread = sum.over(used).about(mean);
  keep_plane(pixel, *middle, mean, smallest_eigenvector(spread, eigenvalues_symmetric3(spread)));
}

void RangeBorders::fit_row(int v) noexcept {
  const RangeImage& image = *image_;
  constexpr int kRim = kernels::kRangeReach;
  float* const ninth = row_[9].data();
  each_block(v, [&](std::ptrdiff_t at, int u) {
    kernels::fit_patches(places(), at, ninth + u, spread_at(u));
  });
  const auto inner = static_cast<std::size_t>(image.width - 2 * kRim);
  kernels::eigenvalues(spread_rows(), inner, row_[10].data() + kRim, row_[11].data() + kRim,
                       row_[12].data() + kRim);
  for (int u = 0; u < image.width; ++u) {
    const std::size_t pixel = image.at(u, v);
    const auto i = static_cast<std::size_t>(u);
    const bool rim = u < kRim || u >= image.width - kRim;
    if (rim || !image.valid(pixel) || !wanted(pixel) || !(ninth[i] < kTooFew_m2)) {
      fit_surface(u, v);
      continue;
    }
    const auto value = [&](std::size_t plane) { return static_cast<double>(row_[plane][i]); };
    const Symmetric3 spread = {value(0), value(1), value(2), value(3), value(4), value(5)};
    keep_plane(pixel, value(9), Vec3d(value(6), value(7), value(8)),
               smallest_eigenvector(spread, Vec3d(value(10), value(11), value(12))));
  }
}

void RangeBorders::fit_surfaces() noexcept {
  const RangeImage& image = *image_;
  for (std::span<float>& plane : row_) {
    const std::size_t used = static_cast<std::size_t>(image.width) + kernels::kEigenBlock;
    std::fill_n(plane.begin(), std::min(used, plane.size()), 0.0F);
  }
  for (int v = 0; v < image.height; ++v) {
    if (params_.plane_radius_px == 2 && by_blocks(v, 2)) {
      fit_row(v);
      continue;
    }
    for (int u = 0; u < image.width; ++u) fit_surface(u, v);
  }
}

/// Change of a pixel that is no border: spread of the normals along the eight beams around it.
void RangeBorders::measure_change(int u, int v, double min_change) noexcept {
  const RangeImage& image = *image_;
  const std::size_t pixel = image.at(u, v);
  if (reach_m2_[pixel] < 0.0F) return;
  Symmetric3 sum;
  Vec3d mean = Vec3d::Zero();
  double count = 0.0;
  const Vec3d own = normal(pixel);
  for (int beam = 0; beam < 9; ++beam) {
    if (beam == 4) continue;
    for (int step = 1; step <= params_.curvature_radius_px; ++step) {
      const int u2 = u + step * (beam % 3 - 1);
      const int v2 = v + step * (beam / 3 - 1);
      if (!image.valid(u2, v2)) continue;
      const std::size_t other = image.at(u2, v2);
      if (excluded(other)) break;
      if (reach_m2_[other] < 0.0F) continue;
      const Vec3d d = normal(other) - own;
      sum.add(d.x(), d.y(), d.z());
      mean += d;
      count += 1.0;
    }
  }
  if (count < 3.0) return;
  mean /= count;
  const Symmetric3 spread = sum.over(count).about(mean);
  const double change = std::sqrt(std::max(0.0, eigenvalues_symmetric3(spread)[2]));
  change_[pixel] = static_cast<float>(change);
  if (change >= min_change) direction_[pixel] = largest_eigenvector(spread).cast<float>();
}

void RangeBorders::measure_row(int v, double min_change) noexcept {
  const RangeImage& image = *image_;
  constexpr int kRim = kernels::kRangeReach;
  const kernels::RangePlanes normals{normal_[0].data(), normal_[1].data(), normal_[2].data(),
                                     image.width};
  float* const counts = row_[9].data();
  each_block(v, [&](std::ptrdiff_t at, int u) {
    kernels::beam_spread(normals, code_.data(), at, counts + u, spread_at(u));
  });
  const auto inner = static_cast<std::size_t>(image.width - 2 * kRim);
  kernels::eigenvalues(spread_rows(), inner, row_[10].data() + kRim, row_[11].data() + kRim,
                       row_[12].data() + kRim);
  for (int u = 0; u < image.width; ++u) {
    const std::size_t pixel = image.at(u, v);
    const auto i = static_cast<std::size_t>(u);
    if (change_[pixel] != 0.0F || excluded(pixel)) continue;
    if (u < kRim || u >= image.width - kRim) {
      measure_change(u, v, min_change);
      continue;
    }
    if (reach_m2_[pixel] < 0.0F || counts[i] < 3.0F) continue;
    const auto value = [&](std::size_t plane) { return static_cast<double>(row_[plane][i]); };
    const double change = std::sqrt(std::max(0.0, value(12)));
    change_[pixel] = static_cast<float>(change);
    if (change < min_change) continue;
    const Symmetric3 spread = {value(0), value(1), value(2), value(3), value(4), value(5)};
    direction_[pixel] = largest_eigenvector(spread).cast<float>();
  }
}

void RangeBorders::measure_changes(double min_change) noexcept {
  const RangeImage& image = *image_;
  for (std::size_t pixel = 0; pixel < image.pixels(); ++pixel) {
    const bool border = !excluded(pixel) && !direction_[pixel].isZero(0.0F);
    change_[pixel] = border ? 1.0F : 0.0F;
    code_[pixel] = 0.0F;
    if (!image.valid(pixel)) continue;
    if (excluded(pixel)) {
      code_[pixel] = -1.0F;
    } else if (reach_m2_[pixel] >= 0.0F) {
      code_[pixel] = 1.0F;
    }
  }
  for (int v = 0; v < image.height; ++v) {
    if (params_.curvature_radius_px == 2 && by_blocks(v, 2)) {
      measure_row(v, min_change);
      continue;
    }
    for (int u = 0; u < image.width; ++u) {
      const std::size_t pixel = image.at(u, v);
      if (change_[pixel] == 0.0F && !excluded(pixel)) measure_change(u, v, min_change);
    }
  }
}

}  // namespace grapnel
