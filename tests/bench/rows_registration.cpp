#include <vector>

#include "pipeline/refine/closest_in_cells.h"
#include "pipeline/refine/closest_point_table.h"
#include "pipeline/refine/icp.h"
#include "tests/bench/groups.h"
#include "tests/bench/inputs.h"
#include "tests/bench/peers/open3d.h"
#include "tests/bench/peers/peers.h"
#include "tests/bench/table.h"

namespace grapnel::bench {
namespace {

constexpr int kRuns = 9;
constexpr int kIterations = 20;
constexpr double kDistance_m = 0.03;

/// The table's quick look-up, one voxel a point.
class OneLook final : public ClosestSurface {
 public:
  explicit OneLook(const ClosestPointTable& table) : table_(table) {}
  [[nodiscard]] std::int32_t closest(const Vec3f& p, float) const noexcept override {
    return table_.nearby(p);
  }
  void closest_of_each(const float* x, const float* y, const float* z, std::size_t count,
                       float max_distance_m, std::int32_t* found) const noexcept override {
    table_.nearby_of_each(x, y, z, count, max_distance_m, found);
  }

 private:
  const ClosestPointTable& table_;
};

}  // namespace

void print_registration() {
  test::OwnedSurface fixed = make_ball(20000);
  test::OwnedSurface moving = make_ball(5000);
  ClosestPointTable table;
  ClosestInCells cells;
  const test::ArenaMemory memory([&](Arena& arena) {
    table.reserve(arena, 1000000);
    cells.reserve(arena, 20000);
  });
  table.build(*fixed, kDistance_m);
  Pose start = Pose::Identity();
  start.linear() = rotation_from_vector(Vec3d(0.02, -0.03, 0.02));
  start.translation() = Vec3d(0.002, -0.003, 0.002);
  IcpParams params;
  params.max_iterations = kIterations;
  params.max_points = 5000;
  params.convergence_m = params.convergence_rad = 0.0;
  Icp icp(params);
  const OneLook quick(table);
  const peers::Work peer = peers::icp_to_plane(*moving, *fixed, kDistance_m, kIterations, start);
  const peers::Work open3d =
      peers::o3d::icp_to_plane(*moving, *fixed, kDistance_m, kIterations, start);
  const auto refine = [&](const ClosestSurface& closest) {
    require(icp.refine(*moving, *fixed, closest, start).ok(), "icp");
  };
  std::vector<Row> rows;
  rows.push_back(
      {"ICP point to plane, 20 iterations, 5k on 20k, model table (8 voxels a point in the last "
       "12)",
       3.0,
       1.0,
       {},
       [&] { refine(table); },
       peer,
       open3d});
  rows.push_back({"the same, one voxel a point (as of coarse poses)",
                  3.0,
                  1.0,
                  {},
                  [&] { refine(quick); },
                  peer,
                  open3d});
  rows.push_back({"the same, two unorganised clouds, nothing built before",
                  20.0,
                  8.0,
                  {},
                  [&] {
                    require(cells.build(*fixed, fixed->spacing_m).ok(), "cells");
                    refine(cells);
                  },
                  peer,
                  open3d});
  print_rows(rows, kRuns);
}

}  // namespace grapnel::bench
