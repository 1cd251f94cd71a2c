#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "pipeline/kernels/reference.h"

namespace grapnel::kernels::reference {
namespace {

/// Mean and covariance of offsets, in double.
struct Moments {
  double count = 0.0;
  std::array<double, 3> sum{};
  std::array<double, 6> products{};  // xx, xy, xz, yy, yz, zz

  void add(double x, double y, double z) {
    count += 1.0;
    const std::array<double, 3> p = {x, y, z};
    std::size_t k = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      sum[a] += p[a];
      for (std::size_t b = a; b < 3; ++b) products[k++] += p[a] * p[b];
    }
  }
  void store(int lane, const Spread& out) const {
    const double by = std::max(count, 1.0);
    const std::array<double, 3> mean = {sum[0] / by, sum[1] / by, sum[2] / by};
    float* const entries[6] = {out.xx, out.xy, out.xz, out.yy, out.yz, out.zz};
    std::size_t k = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = a; b < 3; ++b, ++k) {
        entries[k][lane] = static_cast<float>(products[k] / by - mean[a] * mean[b]);
      }
    }
    float* const means[3] = {out.mean_x, out.mean_y, out.mean_z};
    for (std::size_t a = 0; a < 3; ++a) means[a][lane] = static_cast<float>(mean[a]);
  }
};

struct Offset {
  double x = 0.0, y = 0.0, z = 0.0;
  [[nodiscard]] double squared() const { return x * x + y * y + z * z; }
};
template <class Planes>
Offset offset(const Planes& planes, std::ptrdiff_t from, std::ptrdiff_t to) {
  const auto less = [&](const float* plane) {
    return static_cast<double>(plane[to]) - static_cast<double>(plane[from]);
  };
  return {less(planes.x), less(planes.y), less(planes.z)};
}

}  // namespace

void fit_patches(const RangePlanes& image, std::ptrdiff_t at, float* ninth_m2,
                 const Spread& out) noexcept {
  for (int lane = 0; lane < kRangeBlock; ++lane) {
    std::vector<Offset> patch;
    for (std::ptrdiff_t dv = -2; dv <= 2; ++dv) {
      for (std::ptrdiff_t du = -2; du <= 2; ++du) {
        patch.push_back(offset(image, at + lane, at + lane + dv * image.stride + du));
      }
    }
    std::sort(patch.begin(), patch.end(),
              [](const Offset& a, const Offset& b) { return a.squared() < b.squared(); });
    const double ninth = std::min(patch[8].squared(), 4e30);
    Moments moments;
    for (const Offset& p : patch) {
      if (p.squared() <= 4.0 * ninth) moments.add(p.x, p.y, p.z);
    }
    ninth_m2[lane] = static_cast<float>(ninth);
    moments.store(lane, out);
  }
}

void jumps(const RangePlanes& image, const JumpPlanes& planes, std::ptrdiff_t at,
           std::ptrdiff_t step, float* out) noexcept {
  for (int lane = 0; lane < kRangeBlock; ++lane) {
    const std::ptrdiff_t here = at + lane;
    const double reach = static_cast<double>(planes.reach_m2[here]);
    out[lane] = 0.0F;
    if (reach < 0.0) continue;
    if (image.x[here + step] > 1.5e15F) {
      out[lane] = 1.0F;
      continue;
    }
    Offset mean;
    double range = 0.0;
    double count = 0.0;
    for (std::ptrdiff_t i = 1; i <= 3; ++i) {
      if (!(image.x[here + i * step] < 1e14F)) continue;
      const Offset p = offset(image, here, here + i * step);
      mean = {mean.x + p.x, mean.y + p.y, mean.z + p.z};
      range += static_cast<double>(planes.range[here + i * step]);
      count += 1.0;
    }
    if (count == 0.0) continue;
    mean = {mean.x / count, mean.y / count, mean.z / count};
    if (!(mean.squared() > reach)) continue;
    const double score = 1.0 - std::sqrt(reach / mean.squared());
    const bool nearer = range / count < static_cast<double>(planes.range[here]);
    out[lane] = static_cast<float>(nearer ? -score : score);
  }
}

void beam_spread(const RangePlanes& normals, const float* code, std::ptrdiff_t at, float* count,
                 const Spread& out) noexcept {
  for (int lane = 0; lane < kRangeBlock; ++lane) {
    const std::ptrdiff_t here = at + lane;
    Moments moments;
    for (std::ptrdiff_t dv = -1; dv <= 1; ++dv) {
      for (std::ptrdiff_t du = -1; du <= 1; ++du) {
        if (du == 0 && dv == 0) continue;
        for (std::ptrdiff_t i = 1; i <= 2; ++i) {
          const std::ptrdiff_t pixel = here + i * (dv * normals.stride + du);
          if (code[pixel] < 0.0F) break;
          if (code[pixel] == 0.0F) continue;
          const Offset p = offset(normals, here, pixel);
          moments.add(p.x, p.y, p.z);
        }
      }
    }
    count[lane] = static_cast<float>(moments.count);
    moments.store(lane, out);
  }
}

void nearest_in_window(const PixelPlanes& planes, std::ptrdiff_t first,
                       const WindowSelection& selection, float* sum_m,
                       float* farthest_m2) noexcept {
  const std::ptrdiff_t reach = selection.reach();
  for (std::size_t lane = 0; lane < kLanes; ++lane) {
    const std::ptrdiff_t centre = first + static_cast<std::ptrdiff_t>(lane);
    std::vector<double> squares;
    for (std::ptrdiff_t dv = -reach; dv <= reach; ++dv) {
      for (std::ptrdiff_t du = -reach; du <= reach; ++du) {
        if (du == 0 && dv == 0) continue;
        squares.push_back(offset(planes, centre, centre + dv * planes.stride + du).squared());
      }
    }
    std::sort(squares.begin(), squares.end());
    double sum = 0.0;
    for (std::size_t i = 0; i < selection.nearest(); ++i) sum += std::sqrt(squares[i]);
    sum_m[lane] = static_cast<float>(sum);
    farthest_m2[lane] = static_cast<float>(squares[selection.nearest() - 1]);
  }
}

void fit_planes(const FitRow& row, std::size_t count, float* nx, float* ny, float* nz) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    const float* centre = row.inverse_m + i;
    double sum = 0.0;
    double along_u = 0.0;
    double along_v = 0.0;
    double low = 1e30;
    double high = 0.0;
    for (std::ptrdiff_t dv = -kFitReach; dv <= kFitReach; ++dv) {
      for (std::ptrdiff_t du = -kFitReach; du <= kFitReach; ++du) {
        const double inverse = static_cast<double>(centre[dv * row.stride + du]);
        sum += inverse;
        along_u += static_cast<double>(du) * inverse;
        along_v += static_cast<double>(dv) * inverse;
        low = std::min(low, inverse);
        high = std::max(high, inverse);
      }
    }
    nx[i] = ny[i] = nz[i] = 0.0F;
    const double mean = sum / 25.0;
    if (!(low > 0.0) || high - low > static_cast<double>(row.max_step) * mean) continue;
    // Least squares over the window: Σ du² is 50.
    const double u = static_cast<double>(row.first_u) + static_cast<double>(i);
    const double x = along_u / 50.0 * static_cast<double>(row.fx);
    const double y = along_v / 50.0 * static_cast<double>(row.fy);
    const double z = mean - along_u / 50.0 * u - along_v / 50.0 * static_cast<double>(row.v);
    const double length = std::sqrt(x * x + y * y + z * z);
    if (!(length > 0.0)) continue;
    nx[i] = static_cast<float>(-x / length);
    ny[i] = static_cast<float>(-y / length);
    nz[i] = static_cast<float>(-z / length);
  }
}

}  // namespace grapnel::kernels::reference
