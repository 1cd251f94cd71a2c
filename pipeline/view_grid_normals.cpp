#include <algorithm>
#include <cmath>

#include "pipeline/kernels/eigenvectors.h"
#include "pipeline/kernels/window_sums.h"
#include "pipeline/neighbours/symmetric3.h"
#include "pipeline/view_grid.h"

namespace grapnel {
namespace {

constexpr float kFewest = 5.0F;
// Spheres reach so many blocks, at least and at most: they stand in at edges.
constexpr double kLeastReach = 2.5;
constexpr int kMostReach = 5;
// Readings of a window that lie farther behind each other than this many of its half-widths are of
// two surfaces, or of one seen flatly.
constexpr double kMostSpan = 4.0;
// The same of readings that lie farther off their plane, in the mean: a step leaves a quarter of
// its height.
constexpr double kMostOff = 0.4;
// Below this ratio of its greater two eigenvalues a sphere's points lie on a line.
constexpr double kLineRatio = 1e-4;
constexpr std::size_t kAtOnce = 64;

/// Half-widths of discs of pixels, by their radius.
template <int kMost>
struct Discs {
  std::array<std::array<std::int16_t, kMost + 1>, kMost + 1> half_width{};

  constexpr Discs() noexcept {
    for (int half = 0; half <= kMost; ++half) {
      for (int dv = 0; dv <= half; ++dv) {
        std::int16_t width = 0;
        while ((width + 1) * (width + 1) + dv * dv <= half * half + half / 2) ++width;
        half_width[static_cast<std::size_t>(half)][static_cast<std::size_t>(dv)] = width;
      }
    }
  }
};

/// Where single precision does not tell the directions apart; zero without a plane.
Vec3f normal_in_full(const Symmetric3& spread) noexcept {
  const Vec3d values = eigenvalues_symmetric3(spread);
  if (!(values[1] > kLineRatio * values[2])) return Vec3f::Zero();
  return smallest_eigenvector(spread, values).cast<float>();
}

/// Turns a mean's normal to the side of its own one, or to the viewpoint.
void set_normal(Surface& to, std::size_t i, const Vec3f& normal) noexcept {
  const Vec3f toward = to.has_normal(i) ? to.normal(i) : Vec3f(to.viewpoint - to.point(i));
  const float sign = normal.dot(toward) < 0.0F ? -1.0F : 1.0F;
  to.nx[i] = sign * normal.x();
  to.ny[i] = sign * normal.y();
  to.nz[i] = sign * normal.z();
}

}  // namespace

/// Covariances of means that wait for their normals.
struct ViewGrid::Batch {
  std::array<std::array<float, kAtOnce>, 6> covariance;
  std::array<std::int32_t, kAtOnce> point;
  std::size_t size = 0;

  void flush(Surface& to) noexcept;
};

void ViewGrid::Batch::flush(Surface& to) noexcept {
  std::array<std::array<float, kAtOnce>, 3> found;
  const auto& c = covariance;
  kernels::smallest_eigenvectors(
      {c[0].data(), c[1].data(), c[2].data(), c[3].data(), c[4].data(), c[5].data()}, size,
      {found[0].data(), found[1].data(), found[2].data()});
  for (std::size_t k = 0; k < size; ++k) {
    Vec3f normal(found[0][k], found[1][k], found[2][k]);
    if (normal.squaredNorm() == 0.0F) {
      const auto wide = [&](std::size_t entry) { return static_cast<double>(c[entry][k]); };
      normal = normal_in_full({wide(0), wide(1), wide(2), wide(3), wide(4), wide(5)});
    }
    set_normal(to, static_cast<std::size_t>(point[k]), normal);
  }
  size = 0;
}

/// Of a strip's row; zero where there is none.
struct ViewGrid::StripNormals {
  std::array<float, kernels::kStrip> x, y, z;
};

/// The covariances of the spheres around some of kBlock elements.
void ViewGrid::add_spheres(std::size_t at, std::uint32_t lanes, double radius_m,
                           Batch& batch) const noexcept {
  static constexpr Discs<kMostReach> kDiscs;
  float nearest_m = kernels::kNowhere;
  float farthest_m = 0.0F;
  for (std::size_t lane = 0; lane < kernels::kBlock; ++lane) {
    if ((lanes >> lane & 1U) == 0) continue;
    nearest_m = std::min(nearest_m, place_[2][at + lane]);
    farthest_m = std::max(farthest_m, place_[2][at + lane]);
  }
  const double focal = std::max(camera_.fx, camera_.fy);
  const double reach_m = std::max(radius_m, kLeastReach * static_cast<double>(farthest_m) / focal);
  const auto reach =
      static_cast<std::size_t>(std::clamp(reach_m * focal / static_cast<double>(nearest_m) + 0.5,
                                          1.0, static_cast<double>(kMostReach)));
  const kernels::WindowShape window{static_cast<int>(reach), kDiscs.half_width[reach].data()};
  const kernels::DensePlanes planes{place_[0].data(), place_[1].data(), place_[2].data(), nullptr,
                                    nullptr,          nullptr,          nullptr,          row_};
  float s[kernels::kWindowSums][kernels::kBlock];
  kernels::window_scatter(planes, static_cast<std::ptrdiff_t>(at), window,
                          static_cast<float>(reach_m * reach_m), true, s);
  for (std::size_t lane = 0; lane < kernels::kBlock; ++lane) {
    if ((lanes >> lane & 1U) == 0) continue;
    const std::size_t k = batch.size++;
    // Of too few there is no plane: they get no spread.
    const float by = s[0][lane] >= kFewest ? 1.0F / s[0][lane] : 0.0F;
    const std::array<float, 3> mean = {s[1][lane] * by, s[2][lane] * by, s[3][lane] * by};
    std::size_t entry = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = a; b < 3; ++b, ++entry) {
        batch.covariance[entry][k] = s[4 + entry][lane] * by - mean[a] * mean[b];
      }
    }
    batch.point[k] = point_[at + lane];
  }
}

void ViewGrid::settle_row(const StripNormals& found, std::size_t at, double radius_m, Batch& batch,
                          Surface& to) const noexcept {
  for (std::size_t first = 0; first < kernels::kStrip; first += kernels::kBlock) {
    std::uint32_t lanes = 0;
    for (std::size_t lane = 0; lane < kernels::kBlock; ++lane) {
      const std::size_t k = first + lane;
      const std::int32_t point = point_[at + k];
      if (point < 0) continue;
      const Vec3f normal(found.x[k], found.y[k], found.z[k]);
      if (normal.z() == 0.0F) {
        lanes |= 1U << lane;
      } else {
        set_normal(to, static_cast<std::size_t>(point), normal);
      }
    }
    if (lanes == 0) continue;
    if (batch.size + kernels::kBlock > kAtOnce) batch.flush(to);
    add_spheres(at + first, lanes, radius_m, batch);
  }
}

void ViewGrid::fit_strip(int across, double radius_m, int reach, Batch& batch,
                         Surface& to) const noexcept {
  constexpr int kRows = 2 * kReach + 1;
  std::array<kernels::RowSums, kRows> sums;
  std::array<const kernels::RowSums*, kRows> window;
  kernels::StripPlace place;
  place.first_u = static_cast<float>(across - camera_.cx);
  place.fx = static_cast<float>(camera_.fx);
  place.fy = static_cast<float>(camera_.fy);
  const double half = reach / std::max(camera_.fx, camera_.fy);  // of a window, over its distance
  place.max_span = static_cast<float>(kMostSpan * half);
  place.max_off = static_cast<float>(kMostOff * half);
  const auto first = static_cast<std::size_t>(across);
  StripNormals found;
  // Row v + kReach takes the place of one that is above the window by now.
  for (int v = -reach; v < blocks_[1] + reach; ++v) {
    kernels::RowSums& last =
        sums[static_cast<std::size_t>(v + kRows) % static_cast<std::size_t>(kRows)];
    kernels::sum_row(inverse_m_.data() + row(v) + first, reach, last);
    const int middle = v - reach;
    if (middle < 0) continue;
    for (int k = -reach; k <= reach; ++k) {
      window[static_cast<std::size_t>(k + reach)] =
          &sums[static_cast<std::size_t>(middle + k + kRows) % static_cast<std::size_t>(kRows)];
    }
    place.v = static_cast<float>(middle - camera_.cy);
    const std::size_t at = row(middle) + first;
    kernels::fit_window_planes(window.data(), reach, inverse_m_.data() + at, place, found.x.data(),
                               found.y.data(), found.z.data());
    settle_row(found, at, radius_m, batch, to);
  }
}

bool ViewGrid::normals(double radius_m, double at_m, Surface& to) const noexcept {
  if (!projects_) return false;
  const double reach = radius_m * std::max(camera_.fx, camera_.fy) / at_m;
  const int rounded = static_cast<int>(std::clamp(reach + 0.5, 2.0, static_cast<double>(kReach)));
  Batch batch;
  for (int across = 0; across < blocks_[0]; across += static_cast<int>(kernels::kStrip)) {
    fit_strip(across, radius_m, rounded, batch, to);
  }
  batch.flush(to);
  return true;
}

}  // namespace grapnel
