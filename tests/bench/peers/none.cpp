// Built where no PCL is installed: the table then has no column of peers.
#include "tests/bench/peers/peers.h"

namespace grapnel::bench::peers {

const char* name() { return "none"; }
Work grid_normals(const Surface&, GridNormals) { return {}; }
Work median_5x5(const Surface&) { return {}; }
Work narf(const Surface&, double) { return {}; }
Work statistical_outliers(const Surface&, int, double) { return {}; }
Work voxels(const Surface&, double) { return {}; }
Work iss(const Surface&, double, double) { return {}; }
Work harris(const Surface&, double) { return {}; }
Work sift(const Surface&, double, int, int, double) { return {}; }
Work curvatures(const Surface&, double) { return {}; }
Work fpfh(const Surface&, double, std::size_t) { return {}; }
Work pfh(const Surface&, double, std::size_t) { return {}; }
Work spin_images(const Surface&, double, std::size_t) { return {}; }
Work match_33(const float*, const float*, std::size_t, std::size_t) { return {}; }
Work ransac(const Surface&, const Surface&, const int*, double, int) { return {}; }
Work icp_to_plane(const Surface&, const Surface&, double, int, const Pose&) { return {}; }
std::optional<Pose> register_pair(const Surface&, const Surface&, double, FirstPose) { return {}; }

}  // namespace grapnel::bench::peers
