#include "pipeline/preprocess/normals.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/kernels/eigenvectors.h"
#include "pipeline/neighbours/symmetric3.h"

namespace grapnel {

FieldTable pca_normals_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&PcaNormalsParams::radius_m>("radius_m", "m", 0.0, 10.0,
                                                "neighbourhood; 0 = radius_ratio spacings"),
      number_field<&PcaNormalsParams::radius_ratio>("radius_ratio", "", 1.0, 20.0,
                                                    "neighbourhood in spacings of the surface"),
      number_field<&PcaNormalsParams::k>("k", "", 0, 1000,
                                         "nearest points instead of a radius; 0 = radius"),
      number_field<&PcaNormalsParams::min_neighbours>("min_neighbours", "", 3, 1000,
                                                      "fewer, the point included, give no normal"),
  };
  return kFields;
}

namespace {

/// Second eigenvalue to largest below which a neighbourhood is a line and has no plane.
constexpr double kLineRatio = 1e-4;

/// Moments of a list of neighbours about the point, in double.
Symmetric3 covariance_of(const Surface& surface, std::size_t point_i,
                         const Neighbourhood& around) noexcept {
  const Vec3d origin = surface.point(point_i).cast<double>();
  Symmetric3 sum;
  Vec3d mean = Vec3d::Zero();
  for (const std::int32_t index : around.index) {
    const Vec3d d = surface.point(static_cast<std::size_t>(index)).cast<double>() - origin;
    sum.add(d.x(), d.y(), d.z());
    mean += d;
  }
  const double inverse = 1.0 / static_cast<double>(around.size());
  mean *= inverse;
  return {sum.xx * inverse - mean.x() * mean.x(), sum.xy * inverse - mean.x() * mean.y(),
          sum.xz * inverse - mean.x() * mean.z(), sum.yy * inverse - mean.y() * mean.y(),
          sum.yz * inverse - mean.y() * mean.z(), sum.zz * inverse - mean.z() * mean.z()};
}

/// Across the neighbourhood's plane; zero of a line, which has none.
Vec3d plane_normal(const Symmetric3& spread) noexcept {
  const Vec3d values = eigenvalues_symmetric3(spread);
  if (!(values[1] > kLineRatio * values[2])) return Vec3d::Zero();
  return smallest_eigenvector(spread, values);
}

/// Surface variation for a normal: nᵀCn is the smallest eigenvalue, the trace the sum of all.
double variation_along(const Symmetric3& c, const Vec3d& n) noexcept {
  const double across = n.x() * (c.xx * n.x() + 2.0 * (c.xy * n.y() + c.xz * n.z())) +
                        n.y() * (c.yy * n.y() + 2.0 * c.yz * n.z()) + n.z() * n.z() * c.zz;
  return std::max(0.0, across) / (c.xx + c.yy + c.zz);
}

}  // namespace

/// Covariances of points that wait for their normals.
class PcaNormals::Batch {
 public:
  [[nodiscard]] bool has_room() const noexcept { return size_ + kernels::kBlock <= kAtOnce; }

  /// Sums about a point: those of one lane. Of fewer than `needed` there is no spread.
  void add(const float (*sums)[kernels::kBlock], std::size_t lane, float needed,
           std::size_t point_i) noexcept {
    const float by = sums[0][lane] >= needed ? 1.0F / sums[0][lane] : 0.0F;
    const std::array<float, 3> mean = {sums[1][lane] * by, sums[2][lane] * by, sums[3][lane] * by};
    std::size_t entry = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = a; b < 3; ++b, ++entry) {
        covariance_[entry][size_] = sums[4 + entry][lane] * by - mean[a] * mean[b];
      }
    }
    point_[size_++] = point_i;
  }

  /// Calls use(point, unit normal or zero, variation) of each and is empty then.
  template <class Use>
  void flush(const Use& use) noexcept {
    std::array<std::array<float, kAtOnce>, 3> found;
    const auto& c = covariance_;
    kernels::smallest_eigenvectors(
        {c[0].data(), c[1].data(), c[2].data(), c[3].data(), c[4].data(), c[5].data()}, size_,
        {found[0].data(), found[1].data(), found[2].data()});
    for (std::size_t k = 0; k < size_; ++k) {
      const auto entry = [&](std::size_t i) { return static_cast<double>(c[i][k]); };
      const Symmetric3 spread{entry(0), entry(1), entry(2), entry(3), entry(4), entry(5)};
      Vec3d normal(static_cast<double>(found[0][k]), static_cast<double>(found[1][k]),
                   static_cast<double>(found[2][k]));
      if (normal.isZero(0.0)) normal = plane_normal(spread);
      use(point_[k], normal, normal.isZero(0.0) ? 0.0 : variation_along(spread, normal));
    }
    size_ = 0;
  }

 private:
  static constexpr std::size_t kAtOnce = 64;

  std::array<std::array<float, kAtOnce>, 6> covariance_;
  std::array<std::size_t, kAtOnce> point_;
  std::size_t size_ = 0;
};

void PcaNormals::reserve(Arena& arena, const Limits& limits) {
  search_.reserve(arena, limits);
  curvature_memory_ = arena.take<float>(std::max(limits.max_points, limits.max_model_points));
}

void PcaNormals::store(Surface& surface, std::size_t point_i, Vec3d normal,
                       double variation) noexcept {
  const double toward = normal.dot(middle_ - surface.point(point_i).cast<double>());
  if (surface.has_viewpoint ? toward < 0.0 : toward > 0.0) normal = -normal;
  surface.nx[point_i] = static_cast<float>(normal.x());
  surface.ny[point_i] = static_cast<float>(normal.y());
  surface.nz[point_i] = static_cast<float>(normal.z());
  curvature_memory_[point_i] = static_cast<float>(variation);
}

void PcaNormals::estimate_each(Surface& surface, double radius_m) noexcept {
  const auto needed = static_cast<std::size_t>(params_.min_neighbours);
  for (std::size_t i = 0; i < surface.size; ++i) {
    Symmetric3 spread;
    std::size_t count = 0;
    if (params_.k > 0) {
      const Neighbourhood around =
          search_.nearest(surface.point(i), static_cast<std::size_t>(params_.k));
      count = around.size();
      spread = covariance_of(surface, i, around);
    } else {
      const kernels::SphereMoments moments = search_.moments(i, static_cast<float>(radius_m));
      count = static_cast<std::size_t>(moments.count);
      spread = covariance(moments);
    }
    const Vec3d normal = count >= needed ? plane_normal(spread) : Vec3d::Zero();
    store(surface, i, normal, normal.isZero(0.0) ? 0.0 : variation_along(spread, normal));
  }
}

void PcaNormals::estimate_in_blocks(Surface& surface, float radius_m) noexcept {
  const auto keep = [&](std::size_t i, const Vec3d& normal, double variation) {
    store(surface, i, normal, variation);
  };
  const auto needed = static_cast<float>(params_.min_neighbours);
  Batch batch;
  for (std::size_t position = 0; position < surface.size;) {
    const kernels::BlockOfPoints block = search_.block_from(position, radius_m);
    float sums[kernels::kWindowSums][kernels::kBlock];
    search_.block_moments(block, radius_m, sums);
    const auto count = static_cast<std::size_t>(block.count);
    for (std::size_t lane = 0; lane < count; ++lane) {
      batch.add(sums, lane, needed, search_.point_at(position + lane));
    }
    if (!batch.has_room()) batch.flush(keep);
    position += count;
  }
  batch.flush(keep);
}

Status PcaNormals::estimate(Surface& surface) noexcept {
  const double radius =
      params_.radius_m > 0.0 ? params_.radius_m : params_.radius_ratio * surface.spacing_m;
  if (params_.k == 0 && !(radius > 0.0)) return Error{Code::BadParameter, Stage::Normals, 0};
  const double typical = radius > 0.0 ? radius : 1e-3;
  if (const Status built = search_.build(surface, typical); !built.ok()) {
    return Error{built.error().code, Stage::Normals, built.error().detail};
  }
  curvature_ = curvature_memory_.first(surface.size);
  middle_ = surface.has_viewpoint ? Vec3d(surface.viewpoint.cast<double>()) : centroid(surface);
  if (params_.k == 0 && !search_.uses_grid()) {
    estimate_in_blocks(surface, static_cast<float>(radius));
  } else {
    estimate_each(surface, radius);
  }
  return {};
}

}  // namespace grapnel
