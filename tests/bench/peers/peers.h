#pragma once

#include <cstddef>
#include <functional>
#include <optional>

#include "pipeline/surface.h"

/// Stages of the installed PCL on our inputs. Each call converts its input, which is not measured,
/// and returns what is; an empty function where no PCL was found at build time.
namespace grapnel::bench::peers {

using Work = std::function<void()>;

/// "PCL 1.13.0", or "none".
[[nodiscard]] const char* name();

// On a camera's grid.
enum class GridNormals { DepthChange, Gradient, Covariance };
[[nodiscard]] Work grid_normals(const Surface& surface, GridNormals method);
[[nodiscard]] Work median_5x5(const Surface& surface);
[[nodiscard]] Work narf(const Surface& surface, double support_m);

// On points.
[[nodiscard]] Work statistical_outliers(const Surface& surface, int k, double deviations);
[[nodiscard]] Work voxels(const Surface& surface, double leaf_m);
[[nodiscard]] Work iss(const Surface& surface, double salient_radius_m, double non_max_radius_m);
[[nodiscard]] Work harris(const Surface& surface, double radius_m);
[[nodiscard]] Work sift(const Surface& surface, double min_scale_m, int octaves, int scales,
                        double min_contrast);
[[nodiscard]] Work curvatures(const Surface& surface, double radius_m);

// Descriptors of every `step`-th point, `count` of them.
[[nodiscard]] Work fpfh(const Surface& surface, double radius_m, std::size_t count);
[[nodiscard]] Work pfh(const Surface& surface, double radius_m, std::size_t count);
[[nodiscard]] Work spin_images(const Surface& surface, double radius_m, std::size_t count);

/// Best two of `target` for each row of `source`, rows of 33 numbers, by a tree built before.
[[nodiscard]] Work match_33(const float* source, const float* target, std::size_t rows,
                            std::size_t stride);
/// pair_of[i] is the target point of source point i.
[[nodiscard]] Work ransac(const Surface& source, const Surface& target, const int* pair_of,
                          double inlier_distance_m, int draws);
/// Its tree is built before.
[[nodiscard]] Work icp_to_plane(const Surface& source, const Surface& target, double distance_m,
                                int iterations, const Pose& start);

/// How PCL's chain from two views to a pose gets its first one.
enum class FirstPose {
  Rejector,     ///< the nearest features both ways, CorrespondenceRejectorSampleConsensus
  Prerejective  ///< SampleConsensusPrerejective, with its tutorial's numbers
};
/// Voxels of `voxel_m`, normals within 2 of them, FPFH within 5, a first pose, ICP point to plane.
/// No answer where no PCL was found at build time.
[[nodiscard]] std::optional<Pose> register_pair(const Surface& source, const Surface& target,
                                                double voxel_m, FirstPose first);

}  // namespace grapnel::bench::peers
