#include "drivers/synthetic/shapes.h"

#include <algorithm>
#include <vector>

#include "base/assert.h"
#include "base/math.h"

namespace grapnel {
namespace {

/// Cells between the sorted coordinates of all blocks' faces.
struct CellGrid {
  std::vector<double> cuts_m[3];
  std::vector<bool> filled;

  [[nodiscard]] int cells(int axis) const { return static_cast<int>(cuts_m[axis].size()) - 1; }
  [[nodiscard]] std::size_t index(const int* cell) const {
    return static_cast<std::size_t>((cell[2] * cells(1) + cell[1]) * cells(0) + cell[0]);
  }
  [[nodiscard]] bool is_filled(const int* cell) const {
    for (int axis = 0; axis < 3; ++axis) {
      if (cell[axis] < 0 || cell[axis] >= cells(axis)) return false;
    }
    return filled[index(cell)];
  }
};

CellGrid fill_cells(std::span<const Block> blocks) {
  CellGrid grid;
  for (int axis = 0; axis < 3; ++axis) {
    for (const Block& block : blocks) {
      grid.cuts_m[axis].push_back(block.low_m[axis]);
      grid.cuts_m[axis].push_back(block.high_m[axis]);
    }
    std::sort(grid.cuts_m[axis].begin(), grid.cuts_m[axis].end());
    grid.cuts_m[axis].erase(std::unique(grid.cuts_m[axis].begin(), grid.cuts_m[axis].end()),
                            grid.cuts_m[axis].end());
  }
  grid.filled.assign(static_cast<std::size_t>(grid.cells(0) * grid.cells(1) * grid.cells(2)),
                     false);
  int cell[3];
  for (cell[2] = 0; cell[2] < grid.cells(2); ++cell[2]) {
    for (cell[1] = 0; cell[1] < grid.cells(1); ++cell[1]) {
      for (cell[0] = 0; cell[0] < grid.cells(0); ++cell[0]) {
        for (const Block& block : blocks) {
          bool inside = true;
          for (int axis = 0; axis < 3; ++axis) {
            const double low_m = grid.cuts_m[axis][static_cast<std::size_t>(cell[axis])];
            inside = inside && low_m >= block.low_m[axis] && low_m < block.high_m[axis];
          }
          if (inside) grid.filled[grid.index(cell)] = block.filled;
        }
      }
    }
  }
  return grid;
}

void add_cell_face(const CellGrid& grid, const int* cell, int axis, bool upper, Mesh& mesh) {
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  std::uint32_t corner[4];
  constexpr int kStep[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (int i = 0; i < 4; ++i) {
    Vec3d point;
    point[axis] = grid.cuts_m[axis][static_cast<std::size_t>(cell[axis] + (upper ? 1 : 0))];
    point[u] = grid.cuts_m[u][static_cast<std::size_t>(cell[u] + kStep[i][0])];
    point[v] = grid.cuts_m[v][static_cast<std::size_t>(cell[v] + kStep[i][1])];
    corner[i] = mesh.add_vertex(point);
  }
  if (upper) {
    mesh.add_quad(corner[0], corner[1], corner[2], corner[3]);
  } else {
    mesh.add_quad(corner[3], corner[2], corner[1], corner[0]);
  }
}

struct RingPoint {
  double radius_m;
  double z_m;
};

/// Turns a profile, which runs from the bottom's centre outward, up and in again, about z.
Mesh revolve(std::span<const RingPoint> profile, int segments) {
  Mesh mesh;
  for (const RingPoint& ring : profile) {
    for (int i = 0; i < segments; ++i) {
      const double angle_rad = 2.0 * math::kPi * i / segments;
      mesh.add_vertex(
          {ring.radius_m * math::cos(angle_rad), ring.radius_m * math::sin(angle_rad), ring.z_m});
    }
  }
  const auto per_ring = static_cast<std::uint32_t>(segments);
  for (std::uint32_t ring_i = 0; ring_i + 1 < profile.size(); ++ring_i) {
    const bool from_axis = profile[ring_i].radius_m == 0.0;
    const bool to_axis = profile[ring_i + 1].radius_m == 0.0;
    for (std::uint32_t i = 0; i < per_ring; ++i) {
      const std::uint32_t low = ring_i * per_ring + i;
      const std::uint32_t low_next = ring_i * per_ring + (i + 1) % per_ring;
      const std::uint32_t high = low + per_ring;
      const std::uint32_t high_next = low_next + per_ring;
      if (!from_axis) mesh.add_triangle(low, low_next, to_axis ? high : high_next);
      if (!to_axis) mesh.add_triangle(low, high_next, high);
    }
  }
  return mesh;
}

}  // namespace

Vec3d default_size_m(PartKind kind) {
  switch (kind) {
    case PartKind::Box:
      return {0.40, 0.30, 0.20};
    case PartKind::Carton:
      return {0.38, 0.28, 0.22};
    case PartKind::Barrel:
      return {0.28, 0.28, 0.34};
    case PartKind::Sack:
      return {0.50, 0.34, 0.16};
    case PartKind::Mesh:
      break;
  }
  return Vec3d::Zero();
}

std::string_view symmetry_name(PartKind kind) {
  if (kind == PartKind::Box) return "box";
  if (kind == PartKind::Barrel) return "axis_z";
  return "none";
}

Mesh make_blocks(std::span<const Block> blocks) {
  const CellGrid grid = fill_cells(blocks);
  Mesh mesh;
  int cell[3];
  for (cell[2] = 0; cell[2] < grid.cells(2); ++cell[2]) {
    for (cell[1] = 0; cell[1] < grid.cells(1); ++cell[1]) {
      for (cell[0] = 0; cell[0] < grid.cells(0); ++cell[0]) {
        if (!grid.is_filled(cell)) continue;
        for (int axis = 0; axis < 3; ++axis) {
          for (const int side : {-1, 1}) {
            int other[3] = {cell[0], cell[1], cell[2]};
            other[axis] += side;
            if (!grid.is_filled(other)) add_cell_face(grid, cell, axis, side > 0, mesh);
          }
        }
      }
    }
  }
  return mesh;
}

Mesh make_box(const Vec3d& size_m) {
  const Block block{-0.5 * size_m, 0.5 * size_m, true};
  return make_blocks({&block, 1});
}

Mesh make_carton(const Vec3d& size_m) {
  const Vec3d high = 0.5 * size_m;
  const Vec3d low = -high;
  const double deck_m = high.z() - kCartonStep_m;
  // The L: one leg along the +y edge, one along the -x edge; both end where no mirror image of the
  // outline does. The recess lies in the free corner.
  const Block blocks[] = {
      {low, {high.x(), high.y(), deck_m}, true},
      {{low.x(), high.y() - 0.40 * size_m.y(), deck_m},
       {low.x() + 0.62 * size_m.x(), high.y(), high.z()},
       true},
      {{low.x(), low.y(), deck_m}, {low.x() + 0.26 * size_m.x(), high.y(), high.z()}, true},
      {{high.x() - 0.28 * size_m.x(), low.y() + 0.14 * size_m.y(), deck_m - kCartonStep_m},
       {high.x() - 0.12 * size_m.x(), low.y() + 0.50 * size_m.y(), deck_m},
       false},
  };
  return make_blocks(blocks);
}

Mesh make_barrel(const Vec3d& size_m) {
  constexpr int kSegments = 96;  // sagitta 0.08 mm at 0.15 m radius: far below the sensor's noise
  constexpr double kRelief_m = 0.008;
  constexpr double kRim_m = 0.02;
  const double outer = 0.5 * size_m.x();
  const double body = outer - kRelief_m;
  const double top = 0.5 * size_m.z();
  const double hoop = size_m.z() / 6.0;
  const RingPoint profile[] = {
      {0.0, -top + 0.01},
      {outer - kRim_m, -top + 0.01},
      {outer - kRim_m, -top},
      {outer, -top},
      {outer, -top + 0.016},
      {body, -top + 0.024},
      {body, -hoop - 0.016},
      {outer, -hoop - 0.008},
      {outer, -hoop + 0.008},
      {body, -hoop + 0.016},
      {body, hoop - 0.016},
      {outer, hoop - 0.008},
      {outer, hoop + 0.008},
      {body, hoop + 0.016},
      {body, top - 0.024},
      {outer, top - 0.016},
      {outer, top},
      {outer - kRim_m, top},
      {outer - kRim_m, top - 0.02},
      {0.035, top - 0.02},
      {0.035, top - 0.003},
      {0.0, top - 0.003},
  };
  return revolve(profile, kSegments);
}

Mesh make_shape(PartKind kind, const Vec3d& size_m, std::uint64_t seed) {
  GRAPNEL_ASSERT(kind != PartKind::Mesh);
  switch (kind) {
    case PartKind::Carton:
      return make_carton(size_m);
    case PartKind::Barrel:
      return make_barrel(size_m);
    case PartKind::Sack:
      return make_sack(size_m, seed);
    default:
      return make_box(size_m);
  }
}

}  // namespace grapnel
