// Local planes of a range image and how their normals spread: the fast engine in blocks of a row,
// the reference engine pixel by pixel.
#include <algorithm>
#include <array>
#include <bit>
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

}  // namespace

kernels::RangePlanes RangeBorders::places() const noexcept {
  return {image_->x.data(), image_->y.data(), image_->z.data(), image_->stride()};
}

/// Covariances of a block's pixels.
struct RangeBorders::BlockSpread {
  static constexpr std::size_t kEntries = 6;
  std::array<std::array<float, kernels::kRangeBlock>, kEntries> entry{};

  [[nodiscard]] kernels::Spread with_mean(float* x, float* y, float* z) noexcept {
    return {entry[0].data(),
            entry[1].data(),
            entry[2].data(),
            entry[3].data(),
            entry[4].data(),
            entry[5].data(),
            x,
            y,
            z};
  }
  [[nodiscard]] kernels::SymmetricPlanes planes() const noexcept {
    return {entry[0].data(), entry[1].data(), entry[2].data(),
            entry[3].data(), entry[4].data(), entry[5].data()};
  }
  [[nodiscard]] Symmetric3 of(std::size_t lane) const noexcept {
    const auto value = [&](std::size_t k) { return static_cast<double>(entry[k][lane]); };
    return {value(0), value(1), value(2), value(3), value(4), value(5)};
  }
};

/// Whether rows are worked on in blocks.
bool RangeBorders::by_blocks() const noexcept {
  return params_.engine == Engine::Fast && image_->width >= kernels::kRangeBlock;
}

/// The normal is turned toward the camera.
void RangeBorders::keep_plane(std::size_t pixel, double reach_m2, const Vec3d& mean,
                              const Vec3d& normal) noexcept {
  const Vec3d own = image_->place(pixel);
  const double sign = normal.dot(own) > 0.0 ? -1.0 : 1.0;
  reach_m2_[pixel] = static_cast<float>(reach_m2);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    normal_[axis][pixel] = static_cast<float>(sign * normal[k]);
    mean_[axis][pixel] = static_cast<float>(mean[k]);
  }
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

void RangeBorders::fit_block(int u, int v) noexcept {
  const std::size_t first = image_->at(u, v);
  BlockSpread spread;
  kernels::fit_patches(places(), static_cast<std::ptrdiff_t>(first), &reach_m2_[first],
                       spread.with_mean(&mean_[0][first], &mean_[1][first], &mean_[2][first]));
  const kernels::VectorPlanes normals{&normal_[0][first], &normal_[1][first], &normal_[2][first]};
  kernels::smallest_eigenvectors(spread.planes(), kernels::kRangeBlock, normals);
  std::uint32_t missing = kernels::face_camera(places(), static_cast<std::ptrdiff_t>(first),
                                               normals, &reach_m2_[first]);
  for (; missing != 0; missing &= missing - 1) {
    const auto lane = static_cast<std::size_t>(std::countr_zero(missing));
    const std::size_t pixel = first + lane;
    if (reach_m2_[pixel] >= kernels::kTooFew_m2) {
      fit_surface(u + static_cast<int>(lane), v);
      continue;
    }
    const Vec3d mean = Vec3f(mean_[0][pixel], mean_[1][pixel], mean_[2][pixel]).cast<double>();
    const Symmetric3 matrix = spread.of(lane);
    keep_plane(pixel, static_cast<double>(reach_m2_[pixel]), mean,
               smallest_eigenvector(matrix, eigenvalues_symmetric3(matrix)));
  }
  if (params_.wanted.empty()) return;
  for (std::size_t lane = 0; lane < kernels::kRangeBlock; ++lane) {
    if (!wanted(first + lane)) reach_m2_[first + lane] = -1.0F;
  }
}

void RangeBorders::fit_surfaces() noexcept {
  const RangeImage& image = *image_;
  std::fill_n(reach_m2_.begin(), image.pixels(), -1.0F);
  const bool blocks = params_.plane_radius_px == 2 && by_blocks();
  for (int v = 0; v < image.height; ++v) {
    if (blocks) {
      each_block(v, [&](std::ptrdiff_t, int u) { fit_block(u, v); });
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

void RangeBorders::measure_block(std::size_t first, double min_change) noexcept {
  const kernels::RangePlanes normals{normal_[0].data(), normal_[1].data(), normal_[2].data(),
                                     image_->stride()};
  using Values = std::array<float, kernels::kRangeBlock>;
  BlockSpread spread;
  Values count;
  Values change;
  std::array<Values, 3> axis;
  kernels::beam_spread(normals, code_.data(), static_cast<std::ptrdiff_t>(first), count.data(),
                       spread.with_mean(axis[0].data(), axis[1].data(), axis[2].data()));
  kernels::largest_eigenvectors(spread.planes(), kernels::kRangeBlock, change.data(),
                                {axis[0].data(), axis[1].data(), axis[2].data()});
  for (std::size_t lane = 0; lane < kernels::kRangeBlock; ++lane) {
    const std::size_t pixel = first + lane;
    const bool border = obstacle(pixel) && change_[pixel] == 1.0F;
    if (code_[pixel] != 1.0F || border || count[lane] < 3.0F) continue;
    change_[pixel] = change[lane];
    if (static_cast<double>(change[lane]) < min_change) continue;
    Vec3f direction(axis[0][lane], axis[1][lane], axis[2][lane]);
    if (direction.isZero(0.0F)) direction = largest_eigenvector(spread.of(lane)).cast<float>();
    direction_[pixel] = direction;
  }
}

void RangeBorders::measure_changes(double min_change) noexcept {
  const RangeImage& image = *image_;
  std::fill_n(change_.begin(), image.pixels(), 0.0F);
  for (const Candidate& candidate : candidates_.first(candidate_count_)) {
    const auto pixel = static_cast<std::size_t>(candidate.pixel);
    if (!excluded(pixel) && !direction_[pixel].isZero(0.0F)) change_[pixel] = 1.0F;
  }
  const bool blocks = params_.curvature_radius_px == 2 && by_blocks();
  for (int v = 0; v < image.height; ++v) {
    if (blocks) {
      each_block(v, [&](std::ptrdiff_t at, int) {
        measure_block(static_cast<std::size_t>(at), min_change);
      });
      continue;
    }
    for (int u = 0; u < image.width; ++u) {
      const std::size_t pixel = image.at(u, v);
      if (change_[pixel] == 0.0F && !excluded(pixel)) measure_change(u, v, min_change);
    }
  }
}

}  // namespace grapnel
