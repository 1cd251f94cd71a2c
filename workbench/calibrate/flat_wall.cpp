#include "workbench/calibrate/flat_wall.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/formats/text_scanner.h"
#include "base/input_error.h"
#include "drivers/replay/recording.h"
#include "workbench/import/local_recording.h"

namespace grapnel {
namespace {

// Lens and pattern errors are a few percent at most (Herrera et al. 2012); what is further off the
// plane is no wall.
constexpr double kOnPlane = 0.03;
constexpr double kMinPlaneShare = 0.6;
constexpr double kMinReadings = 0.5;
constexpr double kMinCellShare = 0.25;
constexpr double kApart = 1.05;
constexpr int kRounds = 10;
constexpr double kAll = 20.0;

struct PlaneFit {
  Vec3d disparity = Vec3d::Zero();  // 1/z = disparity · (x, y, 1) on the rays (x, y, 1)
  double share = 0.0;
  double rms_m = 0.0;

  [[nodiscard]] double z_m(const Vec3d& ray) const { return 1.0 / disparity.dot(ray); }
  [[nodiscard]] double axis_m() const { return 1.0 / disparity.z(); }
};

Vec3d ray_of(const Intrinsics& k, int width, std::size_t pixel) {
  const auto u = static_cast<double>(pixel % static_cast<std::size_t>(width));
  const auto v = static_cast<double>(pixel / static_cast<std::size_t>(width));
  return {(u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0};
}

bool on_plane(double z, double plane_z) { return std::abs(z - plane_z) < kOnPlane * plane_z; }

/// Least squares of the disparity, in which the sensor's noise is the same at every distance, over
/// the readings near the plane of the round before; at first, near the median's.
PlaneFit fit_plane(const WallView& wall, const Intrinsics& k) {
  std::vector<double> readings;
  for (const double z : wall.z_m) {
    if (z > 0.0) readings.push_back(z);
  }
  const std::size_t count = readings.size();
  if (static_cast<double>(count) < kMinReadings * static_cast<double>(wall.z_m.size())) {
    throw InputError(wall.name + ": " + std::to_string(100 * count / wall.z_m.size()) +
                     " % of its pixels have a reading; 50 % are needed");
  }
  const auto middle = readings.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(readings.begin(), middle, readings.end());
  PlaneFit fit;
  fit.disparity = Vec3d(0.0, 0.0, 1.0 / *middle);
  for (int round = 0; round < kRounds; ++round) {
    Mat3d outer = Mat3d::Zero();
    Vec3d moment = Vec3d::Zero();
    std::size_t near = 0;
    double square = 0.0;
    // All of a tilted wall at first, then less and less beside it.
    const double band = round == 0 ? kAll : round < kRounds / 2 ? 4.0 : 1.0;
    for (std::size_t pixel = 0; pixel < wall.z_m.size(); ++pixel) {
      const double z = wall.z_m[pixel];
      if (z <= 0.0) continue;
      const Vec3d ray = ray_of(k, wall.width, pixel);
      const double off = z - fit.z_m(ray);
      if (std::abs(off) > band * kOnPlane * z) continue;
      ++near;
      square += off * off;
      outer += ray * ray.transpose();
      moment += ray / z;
    }
    if (near < 3) break;
    fit.disparity = outer.ldlt().solve(moment);
    fit.share = static_cast<double>(near) / static_cast<double>(count);
    fit.rms_m = std::sqrt(square / static_cast<double>(near));
  }
  if (fit.share < kMinPlaneShare || fit.axis_m() <= 0.0) {
    throw InputError(wall.name + ": " + std::to_string(std::lround(100.0 * fit.share)) +
                     " % of its readings lie on a plane; 60 % are needed for a wall");
  }
  return fit;
}

/// offset and scale of 1/z' = offset + scale/z; empty when no distance is known.
std::vector<double> fit_law(const std::vector<WallView>& walls, const std::vector<PlaneFit>& fits) {
  Eigen::Matrix2d outer = Eigen::Matrix2d::Zero();
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  std::size_t known = 0;
  for (std::size_t i = 0; i < walls.size(); ++i) {
    if (!walls[i].distance_m) continue;
    ++known;
    const Eigen::Vector2d row(1.0, fits[i].disparity.z());
    outer += row * row.transpose();
    moment += row / *walls[i].distance_m;
  }
  if (known == 0) return {};
  if (known == 1) return {0.0, moment(1) / outer(1, 1)};
  const Eigen::Vector2d law = outer.ldlt().solve(moment);
  if (law(1) <= 0.0) throw InputError("the distances given contradict the walls' order");
  return {law(0), law(1)};
}

WallView straighten(const WallView& wall, const std::vector<double>& law) {
  WallView straight = wall;
  for (double& z : straight.z_m) {
    if (z > 0.0 && !law.empty()) z = std::max(0.0, 1.0 / (law[0] + law[1] / z));
  }
  return straight;
}

/// True over measured depth, cell by cell; cells without readings take their neighbours' mean.
std::vector<double> multipliers_of(const WallView& wall, const PlaneFit& fit, const Intrinsics& k,
                                   const GridShape& grid) {
  const auto cells = static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows);
  std::vector<double> sum(cells, 0.0);
  std::vector<std::size_t> count(cells, 0);
  for (std::size_t pixel = 0; pixel < wall.z_m.size(); ++pixel) {
    const double z = wall.z_m[pixel];
    const double plane_z = fit.z_m(ray_of(k, wall.width, pixel));
    if (z <= 0.0 || !on_plane(z, plane_z)) continue;
    const int u = static_cast<int>(pixel) % wall.width;
    const int v = static_cast<int>(pixel) / wall.width;
    const auto cell = static_cast<std::size_t>(v * grid.rows / wall.height * grid.columns +
                                               u * grid.columns / wall.width);
    sum[cell] += plane_z / z;
    ++count[cell];
  }
  const double enough = kMinCellShare * static_cast<double>(wall.z_m.size() / cells);
  std::vector<double> out(cells, 0.0);
  for (std::size_t cell = 0; cell < cells; ++cell) {
    if (static_cast<double>(count[cell]) >= enough && count[cell] > 0) {
      out[cell] = sum[cell] / static_cast<double>(count[cell]);
    }
  }
  return out;
}

void fill_gaps(std::vector<double>& cells, const GridShape& grid) {
  const auto at = [&](int column, int row) -> double {
    const bool inside = column >= 0 && column < grid.columns && row >= 0 && row < grid.rows;
    return inside ? cells[static_cast<std::size_t>(row * grid.columns + column)] : 0.0;
  };
  for (int round = 0; round < grid.columns + grid.rows; ++round) {
    std::vector<double> next = cells;
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        if (at(column, row) > 0.0) continue;
        double sum = 0.0;
        int count = 0;
        for (const auto& [du, dv] :
             std::array<std::pair<int, int>, 4>{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}}) {
          const double near = at(column + du, row + dv);
          sum += near;
          count += near > 0.0 ? 1 : 0;
        }
        if (count > 0) next[static_cast<std::size_t>(row * grid.columns + column)] = sum / count;
      }
    }
    cells = next;
  }
}

WallView flatten(const WallView& straight, const CameraFile& camera) {
  // Micrometres in 32 bits of depth would do; the tables take 16, so a tenth of a millimetre.
  constexpr double kUnit_m = 1e-4;
  const DepthCorrection correction(camera, kUnit_m);
  WallView flat = straight;
  std::vector<std::uint16_t> counts(straight.z_m.size());
  for (std::size_t i = 0; i < counts.size(); ++i) {
    counts[i] = static_cast<std::uint16_t>(
        std::clamp(std::floor(straight.z_m[i] / kUnit_m + 0.5), 0.0, 65535.0));
  }
  std::vector<float> scratch(correction.scratch_floats());
  correction.apply(counts, scratch);
  for (std::size_t i = 0; i < counts.size(); ++i) flat.z_m[i] = counts[i] * kUnit_m;
  return flat;
}

void check_apart(std::vector<double> distances) {
  std::sort(distances.begin(), distances.end());
  for (std::size_t i = 1; i < distances.size(); ++i) {
    if (distances[i] < kApart * distances[i - 1]) {
      throw InputError("two walls at " + std::to_string(distances[i - 1]) + " m and " +
                       std::to_string(distances[i]) + " m; at least 5 % apart are needed");
    }
  }
}

}  // namespace

WallView read_wall(const std::string& name, std::size_t frames, CameraFile& camera) {
  WallView wall;
  wall.name = name;
  const std::size_t equals = name.rfind('=');
  if (equals != std::string::npos) {
    double distance_m = 0.0;
    wall.name = name.substr(0, equals);
    if (!parse_number(std::string_view(name).substr(equals + 1), distance_m) || distance_m < 0.1 ||
        distance_m > 20.0) {
      throw InputError(name + ": what follows = is the measured distance, 0.1 to 20 m");
    }
    wall.distance_m = distance_m;
  }
  const LocalRecording local(wall.name);
  const Recording recording = Recording::open(local.folder());
  camera = recording.camera();
  if (camera.corrects_depth()) {
    throw InputError(wall.name + ": its depth is corrected already; a recording without is needed");
  }
  wall.width = camera.width;
  wall.height = camera.height;
  const std::size_t count = std::min(frames, recording.frame_count());
  std::vector<std::uint16_t> depth(static_cast<std::size_t>(camera.width * camera.height));
  std::vector<std::uint64_t> sums(depth.size(), 0);
  std::vector<std::size_t> readings(depth.size(), 0);
  for (std::size_t frame = 0; frame < count; ++frame) {
    recording.read_frame(frame, depth, {});
    for (std::size_t i = 0; i < depth.size(); ++i) {
      sums[i] += depth[i];
      readings[i] += depth[i] != 0 ? 1 : 0;
    }
  }
  wall.z_m.resize(depth.size(), 0.0);
  for (std::size_t i = 0; i < depth.size(); ++i) {
    if (2 * readings[i] <= count) continue;
    wall.z_m[i] =
        static_cast<double>(sums[i]) / static_cast<double>(readings[i]) * camera.metres_per_unit;
  }
  return wall;
}

std::vector<WallReport> calibrate_depth(const std::vector<WallView>& walls, const GridShape& grid,
                                        CameraFile& camera) {
  const Intrinsics k = camera.intrinsics();
  std::vector<PlaneFit> fits;
  std::vector<WallReport> reports;
  for (const WallView& wall : walls) {
    fits.push_back(fit_plane(wall, k));
    reports.push_back({wall.name, fits.back().axis_m(), 0.0, fits.back().share, fits.back().rms_m});
  }
  camera.disparity_law = fit_law(walls, fits);
  std::vector<std::pair<double, std::vector<double>>> layers;
  std::vector<double> distances;
  for (const WallView& wall : walls) {
    const WallView straight = straighten(wall, camera.disparity_law);
    const PlaneFit fit = fit_plane(straight, k);
    std::vector<double> cells = multipliers_of(straight, fit, k, grid);
    fill_gaps(cells, grid);
    layers.emplace_back(fit.axis_m(), std::move(cells));
    distances.push_back(fit.axis_m());
  }
  check_apart(distances);
  std::sort(layers.begin(), layers.end());
  camera.grid_columns = grid.columns;
  camera.grid_rows = grid.rows;
  camera.grid_distances_m.clear();
  camera.grid_multipliers.clear();
  for (const auto& [distance_m, cells] : layers) {
    camera.grid_distances_m.push_back(distance_m);
    camera.grid_multipliers.insert(camera.grid_multipliers.end(), cells.begin(), cells.end());
  }
  for (std::size_t i = 0; i < walls.size(); ++i) {
    const PlaneFit flat = fit_plane(flatten(walls[i], camera), k);
    reports[i].corrected_axis_m = flat.axis_m();
    reports[i].rms_after_m = flat.rms_m;
  }
  return reports;
}

}  // namespace grapnel
