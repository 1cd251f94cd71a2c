#pragma once

#include <cstddef>
#include <vector>

#include "workbench/teach/fusion.h"

namespace grapnel {

/// What one view gives to a model.
struct TaughtView {
  std::vector<SurfaceSample> samples;
  Pose model_from_camera = Pose::Identity();
};

struct FusedModelOptions {
  double voxel_m = 0.0;  ///< 0 = `sampling_m`, wider where max_points asks for it
  std::size_t min_views = 1;
  std::size_t max_points = 15000;  ///< holds only where voxel_m is 0
  Box roi;
};

struct FusedModel {
  CloudData cloud;
  double voxel_m = 0.0;
};

/// Averages all views in voxels, weighted by 1/sigma². Throws InputError when no point remains.
[[nodiscard]] FusedModel fuse_views(const std::vector<TaughtView>& views, double sampling_m,
                                    const FusedModelOptions& options);

/// Median distance between neighbouring readings of a camera's views.
[[nodiscard]] double pixel_sampling_m(const std::vector<TaughtView>& views, double focal_px);

}  // namespace grapnel
