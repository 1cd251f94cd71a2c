#include "workbench/teach/fused_model.h"

#include <algorithm>

#include "base/input_error.h"

namespace grapnel {
namespace {

CloudData fuse(const std::vector<TaughtView>& views, double voxel_m,
               const FusedModelOptions& options) {
  Fusion fusion(voxel_m, options.roi);
  for (const TaughtView& view : views) fusion.add(view.samples, view.model_from_camera);
  return fusion.cloud(static_cast<int>(options.min_views));
}

}  // namespace

FusedModel fuse_views(const std::vector<TaughtView>& views, double sampling_m,
                      const FusedModelOptions& options) {
  constexpr double kWiden = 1.15;
  FusedModel model;
  model.voxel_m = options.voxel_m > 0.0 ? options.voxel_m : sampling_m;
  model.cloud = fuse(views, model.voxel_m, options);
  while (options.voxel_m <= 0.0 && model.cloud.size() > options.max_points) {
    model.voxel_m *= kWiden;
    model.cloud = fuse(views, model.voxel_m, options);
  }
  if (model.cloud.size() == 0) {
    throw InputError(
        "no point was seen often enough inside the box; check --roi, --min-views and the views' "
        "poses");
  }
  return model;
}

double pixel_sampling_m(const std::vector<TaughtView>& views, double focal_px) {
  std::vector<float> depth_m;
  for (const TaughtView& view : views) {
    for (const SurfaceSample& sample : view.samples) depth_m.push_back(sample.point.z());
  }
  if (depth_m.empty()) return 0.001;
  const auto middle = depth_m.begin() + static_cast<std::ptrdiff_t>(depth_m.size() / 2);
  std::nth_element(depth_m.begin(), middle, depth_m.end());
  return static_cast<double>(*middle) / focal_px;
}

}  // namespace grapnel
