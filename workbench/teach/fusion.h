#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>

#include "base/cloud.h"
#include "base/geometry.h"
#include "workbench/teach/frame_points.h"

namespace grapnel {

/// Axis-aligned box in the model's frame, metres.
struct Box {
  Vec3d low = Vec3d::Constant(-1e9);
  Vec3d high = Vec3d::Constant(1e9);

  [[nodiscard]] bool contains(const Vec3d& p) const noexcept {
    return (p.array() >= low.array()).all() && (p.array() <= high.array()).all();
  }
};

/// "x0,y0,z0,x1,y1,z1", metres; "" = everywhere. Throws InputError naming `option`.
[[nodiscard]] Box parse_box(const std::string& text, const std::string& option);

/// Averages samples of many views in voxels, weighted by 1 / sigma². Two sides of a thin wall in
/// one voxel stay two points.
class Fusion {
 public:
  Fusion(double voxel_m, const Box& roi) : voxel_m_(voxel_m), roi_(roi) {}

  /// All samples of one view.
  void add(std::span<const SurfaceSample> samples, const Pose& model_from_camera);

  /// Points that at least `min_views` views saw, with unit normals, in the order of their voxels.
  [[nodiscard]] CloudData cloud(int min_views) const;

 private:
  struct Cell {
    Vec3d point = Vec3d::Zero();
    Vec3d normal = Vec3d::Zero();
    double intensity = 0.0;
    double weight = 0.0;
    int views = 0;
    int last_view = -1;

    void add(const SurfaceSample& sample, const Vec3d& p, const Vec3d& n, int view);
  };
  struct Voxel {
    Cell front;
    Cell back;  // normals against the front's
  };

  double voxel_m_;
  Box roi_;
  int view_ = 0;
  std::map<std::array<std::int32_t, 3>, Voxel> voxels_;
};

}  // namespace grapnel
