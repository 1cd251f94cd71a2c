#pragma once

#include <optional>

#include "tests/bench/peers/peers.h"

/// Stages of the installed Open3D on our inputs, as peers.h has PCL's; empty functions where none
/// was found at build time. One thread, whatever the machine has.
namespace grapnel::bench::peers::o3d {

/// "Open3D 0.16.1", or "none".
[[nodiscard]] const char* name();

[[nodiscard]] Work voxels(const Surface& surface, double leaf_m);
[[nodiscard]] Work statistical_outliers(const Surface& surface, int k, double deviations);
/// Covariance of all points within the radius, at most `most` of them.
[[nodiscard]] Work normals(const Surface& surface, double radius_m, int most);
[[nodiscard]] Work iss(const Surface& surface, double salient_radius_m, double non_max_radius_m);
/// Of every point, from all within the radius; it describes no others.
[[nodiscard]] Work fpfh(const Surface& surface, double radius_m);
/// Builds its tree in every run: it keeps none between two calls.
[[nodiscard]] Work icp_to_plane(const Surface& source, const Surface& target, double distance_m,
                                int iterations, const Pose& start);

/// The chain of Open3D's tutorial of global registration, from points to pose: voxels of
/// `voxel_m`, normals within 2 of them, FPFH within 5, RANSAC on the features with its checkers of
/// edge lengths and distances, ICP point to plane. No answer where none was found at build time.
[[nodiscard]] std::optional<Pose> register_pair(const Surface& source, const Surface& target,
                                                double voxel_m);

}  // namespace grapnel::bench::peers::o3d
