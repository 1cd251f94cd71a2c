// Built where no Open3D is installed: the table then has no column of it.
#include "tests/bench/peers/open3d.h"

namespace grapnel::bench::peers::o3d {

const char* name() { return "none"; }
Work voxels(const Surface&, double) { return {}; }
Work statistical_outliers(const Surface&, int, double) { return {}; }
Work normals(const Surface&, double, int) { return {}; }
Work iss(const Surface&, double, double) { return {}; }
Work fpfh(const Surface&, double) { return {}; }
Work icp_to_plane(const Surface&, const Surface&, double, int, const Pose&) { return {}; }
std::optional<Pose> register_pair(const Surface&, const Surface&, double) { return {}; }

}  // namespace grapnel::bench::peers::o3d
