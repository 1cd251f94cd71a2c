#include "workbench/teach/fusion.h"

#include <array>
#include <cmath>

#include "base/input_error.h"
#include "workbench/options.h"

namespace grapnel {

Box parse_box(const std::string& text, const std::string& option) {
  Box box;
  if (text.empty()) return box;
  const std::vector<double> n = parse_numbers(text, 6, option);
  box.low = Vec3d(n[0], n[1], n[2]);
  box.high = Vec3d(n[3], n[4], n[5]);
  if (!(box.low.array() < box.high.array()).all()) {
    throw InputError(option + " " + text +
                     ": each of the first three must be less than its partner");
  }
  return box;
}

void Fusion::Cell::add(const SurfaceSample& sample, const Vec3d& p, const Vec3d& n, int view) {
  const double w = static_cast<double>(sample.weight);
  point += w * p;
  normal += w * n;
  intensity += w * static_cast<double>(sample.intensity);
  weight += w;
  views += last_view != view ? 1 : 0;
  last_view = view;
}

void Fusion::add(std::span<const SurfaceSample> samples, const Pose& model_from_camera) {
  for (const SurfaceSample& sample : samples) {
    const Vec3d p = model_from_camera * sample.point.cast<double>();
    if (!roi_.contains(p)) continue;
    const Vec3d n = model_from_camera.linear() * sample.normal.cast<double>();
    std::array<std::int32_t, 3> key{};
    for (int axis = 0; axis < 3; ++axis) {
      key[static_cast<std::size_t>(axis)] =
          static_cast<std::int32_t>(std::floor(p[axis] / voxel_m_));
    }
    Voxel& voxel = voxels_[key];
    const bool back = voxel.front.weight > 0.0 && voxel.front.normal.dot(n) < 0.0;
    (back ? voxel.back : voxel.front).add(sample, p, n, view_);
  }
  ++view_;
}

CloudData Fusion::cloud(int min_views) const {
  CloudData cloud;
  const auto push = [&](const Cell& cell) {
    if (cell.views < min_views || !(cell.normal.norm() > 0.0)) return;
    const Vec3f p = (cell.point / cell.weight).cast<float>();
    const Vec3f n = cell.normal.normalized().cast<float>();
    cloud.x.push_back(p.x());
    cloud.y.push_back(p.y());
    cloud.z.push_back(p.z());
    cloud.nx.push_back(n.x());
    cloud.ny.push_back(n.y());
    cloud.nz.push_back(n.z());
    cloud.intensity.push_back(static_cast<float>(cell.intensity / cell.weight));
  };
  for (const auto& [key, voxel] : voxels_) {
    push(voxel.front);
    push(voxel.back);
  }
  cloud.width = static_cast<int>(cloud.size());
  return cloud;
}

}  // namespace grapnel
