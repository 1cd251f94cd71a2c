#include "pipeline/preprocess/plane_search.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/kernels/near_plane.h"
#include "pipeline/neighbours/symmetric3.h"

namespace grapnel {

FieldTable plane_search_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&PlaneSearchParams::trials>("plane_trials", "", 1, 100000,
                                               "random planes tried for the dominant one"),
      number_field<&PlaneSearchParams::min_share>(
          "plane_min_share", "", 0.01, 1.0, "of the readings that a dominant plane must hold"),
      number_field<&PlaneSearchParams::sigmas>("plane_sigmas", "", 0.5, 20.0,
                                               "half thickness of a plane in depth noise"),
  };
  return kFields;
}

namespace {

/// Refinement rounds: inliers and least squares settle after two or three.
constexpr int kRounds = 4;
/// Samples counted between two looks at whether enough are left.
constexpr std::size_t kStretch = 256;

/// Plane through three samples; false when they lie on a line of the image.
bool through(const std::array<Vec3d, 3>& p, DepthPlane& plane) noexcept {
  const Vec3d e = p[1] - p[0];
  const Vec3d f = p[2] - p[0];
  const double determinant = e.x() * f.y() - e.y() * f.x();
  if (std::fabs(determinant) < 1e-9) return false;
  plane.a = (e.z() * f.y() - e.y() * f.z()) / determinant;
  plane.b = (e.x() * f.z() - e.z() * f.x()) / determinant;
  plane.c = p[0].z() - plane.a * p[0].x() - plane.b * p[0].y();
  return true;
}

/// Fills normal and offset from the inverse-depth form: 1/z = -(n·ray)/offset.
void to_metric(const Intrinsics& k, DepthPlane& plane) noexcept {
  const Vec3d scaled(-plane.a * k.fx, -plane.b * k.fy,
                     -(plane.c + plane.a * k.cx + plane.b * k.cy));
  const double length = scaled.norm();
  if (length == 0.0) return;
  plane.normal = scaled / length;
  plane.offset_m = 1.0 / length;
}

}  // namespace

DepthPlane depth_plane(const Vec3d& normal, double offset_m, const Intrinsics& k) noexcept {
  DepthPlane plane;
  plane.normal = normal;
  plane.offset_m = offset_m;
  if (offset_m == 0.0) return plane;
  plane.a = -normal.x() / (k.fx * offset_m);
  plane.b = -normal.y() / (k.fy * offset_m);
  plane.c = -normal.z() / offset_m - plane.a * k.cx - plane.b * k.cy;
  return plane;
}

void PlaneSearch::reserve(Arena& arena) {
  for (std::span<float>* plane : {&u_, &v_, &inverse_, &tolerance_}) {
    *plane = arena.take<float>(kMaxSamples);
  }
}

void PlaneSearch::sample(const WorkingDepth& work) noexcept {
  const double pixels = static_cast<double>(work.depth.pixels());
  const int step = std::max(
      1, static_cast<int>(std::ceil(std::sqrt(pixels / static_cast<double>(kMaxSamples)))));
  const double noise = params_.sigmas * params_.sigma_1m_m;
  size_ = 0;
  for (int v = step / 2; v < work.depth.height; v += step) {
    for (int u = step / 2; u < work.depth.width && size_ < kMaxSamples; u += step) {
      if (work.label.at(u, v) == kNoLabel) continue;
      const double inverse = 1.0 / work.depth_m(u, v);
      u_[size_] = static_cast<float>(u);
      v_[size_] = static_cast<float>(v);
      inverse_[size_] = static_cast<float>(inverse);
      // The reading's own quantisation in inverse depth, where it is coarser than the noise.
      tolerance_[size_] =
          static_cast<float>(std::max(noise, work.metres_per_unit * inverse * inverse));
      ++size_;
    }
  }
}

std::size_t PlaneSearch::support(const DepthPlane& plane, std::size_t beaten) const noexcept {
  const auto a = static_cast<float>(plane.a);
  const auto b = static_cast<float>(plane.b);
  const auto c = static_cast<float>(plane.c);
  std::size_t count = 0;
  for (std::size_t begin = 0; begin < size_; begin += kStretch) {
    if (count + (size_ - begin) <= beaten) break;
    const kernels::InverseSamples samples{u_.data() + begin, v_.data() + begin,
                                          inverse_.data() + begin, tolerance_.data() + begin};
    count += kernels::count_near_plane(samples, std::min(size_ - begin, kStretch), a, b, c);
  }
  return count;
}

bool PlaneSearch::refine(DepthPlane& plane) const noexcept {
  // Normal equations about the inliers' mean.
  double count = 0.0;
  Vec3d mean = Vec3d::Zero();
  Symmetric3 sum;
  for (std::size_t i = 0; i < size_; ++i) {
    const double u = static_cast<double>(u_[i]);
    const double v = static_cast<double>(v_[i]);
    const double q = static_cast<double>(inverse_[i]);
    if (std::fabs(q - (plane.a * u + plane.b * v + plane.c)) > static_cast<double>(tolerance_[i])) {
      continue;
    }
    count += 1.0;
    mean += Vec3d(u, v, q);
    sum.add(u, v, q);
  }
  if (count < 3.0) return false;
  mean /= count;
  const double uu = sum.xx - count * mean.x() * mean.x();
  const double uv = sum.xy - count * mean.x() * mean.y();
  const double vv = sum.yy - count * mean.y() * mean.y();
  const double uq = sum.xz - count * mean.x() * mean.z();
  const double vq = sum.yz - count * mean.y() * mean.z();
  const double determinant = uu * vv - uv * uv;
  if (!(determinant > 1e-9 * uu * vv)) return false;
  plane.a = (uq * vv - vq * uv) / determinant;
  plane.b = (uu * vq - uv * uq) / determinant;
  plane.c = mean.z() - plane.a * mean.x() - plane.b * mean.y();
  return true;
}

double PlaneSearch::extent_m(const DepthPlane& plane, const Intrinsics& k) const noexcept {
  double count = 0.0;
  Vec3d mean = Vec3d::Zero();
  Symmetric3 sum;
  for (std::size_t i = 0; i < size_; ++i) {
    const double u = static_cast<double>(u_[i]);
    const double v = static_cast<double>(v_[i]);
    const double q = static_cast<double>(inverse_[i]);
    if (std::fabs(q - (plane.a * u + plane.b * v + plane.c)) > static_cast<double>(tolerance_[i])) {
      continue;
    }
    const Vec3d p((u - k.cx) / (k.fx * q), (v - k.cy) / (k.fy * q), 1.0 / q);
    count += 1.0;
    mean += p;
    sum.add(p.x(), p.y(), p.z());
  }
  mean /= count;
  const Symmetric3 covariance = sum.over(count).about(mean);
  // A uniform strip of width w has variance w²/12 across.
  return std::sqrt(12.0 * std::max(0.0, eigen_symmetric3(covariance).values[1]));
}

bool PlaneSearch::find(const WorkingDepth& work, double labelled_share, double min_extent_m,
                       Rng& rng, DepthPlane& plane) noexcept {
  sample(work);
  if (size_ < 16) return false;
  const auto bound = static_cast<std::uint32_t>(size_);
  const auto draw = [&] {
    const std::size_t i = rng.below(bound);
    return Vec3d(static_cast<double>(u_[i]), static_cast<double>(v_[i]),
                 static_cast<double>(inverse_[i]));
  };
  std::size_t best = 0;
  for (int trial = 0; trial < params_.trials; ++trial) {
    const std::array<Vec3d, 3> triple = {draw(), draw(), draw()};
    DepthPlane candidate;
    if (!through(triple, candidate)) continue;
    const std::size_t count = support(candidate, best);
    if (count <= best) continue;
    best = count;
    plane = candidate;
  }
  if (best < 3) return false;
  for (int round = 0; round < kRounds; ++round) {
    if (!refine(plane)) return false;
  }
  plane.share =
      labelled_share * static_cast<double>(support(plane, 0)) / static_cast<double>(size_);
  if (plane.share < params_.min_share) return false;
  if (min_extent_m > 0.0 && extent_m(plane, work.intrinsics) < min_extent_m) return false;
  to_metric(work.intrinsics, plane);
  return plane.offset_m > 0.0;
}

}  // namespace grapnel
