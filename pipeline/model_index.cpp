#include "pipeline/model_index.h"
#include "pipeline/shared_space.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

namespace grapnel {
namespace {

constexpr std::size_t kCoarseVoxels = 100000;
// A glance's tolerance, in diameters.
constexpr double kFieldReach = 0.06;

// Measured normals come from neighbours this many spacings around.
constexpr double kNormalReach = 3.0;
// Length of the mean normal above which a neighbourhood is flat: within about 15 degrees.
constexpr float kFlat = 0.97F;

// Points drawn at random lie half their even distance from the nearest other one on the average
// (Clark and Evans 1954); points laid out evenly nearly all of it, 0.64 on a barrel with hoops.
constexpr double kScattered = 0.56;
// Taken together over so many even distances, points drawn at random leave hardly a cell empty.
constexpr double kGapless = 1.8;
// Cells in which points are counted, in distances to the nearest one.
constexpr double kCounted = 4.0;

struct CellEntry {
  std::uint64_t key = 0;
  std::uint32_t index = 0;
};

/// Which of the six axis directions a normal is nearest to: keeps both faces at an edge.
std::uint64_t side(const Model& model, std::size_t i) {
  const std::array<float, 3> n = {model.nx[i], model.ny[i], model.nz[i]};
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    if (std::fabs(n[k]) > std::fabs(n[axis])) axis = k;
  }
  return 2 * axis + (n[axis] < 0.0F ? 1 : 0);
}

/// Points sorted by cell and side; equal keys belong together.
std::vector<CellEntry> sort_by_cell(const Model& model, const Vec3d& low, double edge_m) {
  std::vector<CellEntry> entries(model.size());
  for (std::size_t i = 0; i < model.size(); ++i) {
    const Vec3d p = (Vec3d(model.x[i], model.y[i], model.z[i]) - low) / edge_m;
    const auto a = static_cast<std::uint64_t>(p.x());
    const auto b = static_cast<std::uint64_t>(p.y());
    const auto c = static_cast<std::uint64_t>(p.z());
    entries[i].key = (((c << 20U) + b) << 20U | a) << 3U | side(model, i);
    entries[i].index = static_cast<std::uint32_t>(i);
  }
  std::sort(entries.begin(), entries.end(), [](const CellEntry& a, const CellEntry& b) {
    return a.key != b.key ? a.key < b.key : a.index < b.index;
  });
  return entries;
}

std::size_t count_cells(const std::vector<CellEntry>& entries) {
  std::size_t cells = 0;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (i == 0 || entries[i].key != entries[i - 1].key) ++cells;
  }
  return cells;
}

void append_mean(const Model& model, std::span<const CellEntry> cell, Surface& out) {
  Vec3d point = Vec3d::Zero();
  Vec3d normal = Vec3d::Zero();
  double intensity = 0.0;
  for (const CellEntry& entry : cell) {
    const std::uint32_t i = entry.index;
    point += Vec3d(model.x[i], model.y[i], model.z[i]);
    normal += Vec3d(model.nx[i], model.ny[i], model.nz[i]);
    if (!model.intensity.empty()) intensity += static_cast<double>(model.intensity[i]);
  }
  const auto count = static_cast<double>(cell.size());
  point /= count;
  if (normal.norm() > 1e-9) normal.normalize();
  const std::size_t k = out.size++;
  out.x[k] = static_cast<float>(point.x());
  out.y[k] = static_cast<float>(point.y());
  out.z[k] = static_cast<float>(point.z());
  out.nx[k] = static_cast<float>(normal.x());
  out.ny[k] = static_cast<float>(normal.y());
  out.nz[k] = static_cast<float>(normal.z());
  out.intensity[k] = static_cast<float>(intensity / count);
}

void bounds(const Model& model, Vec3d& low, Vec3d& high) {
  low = Vec3d::Constant(std::numeric_limits<double>::max());
  high = -low;
  for (std::size_t i = 0; i < model.size(); ++i) {
    const Vec3d p(model.x[i], model.y[i], model.z[i]);
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
}

/// Spacing at which the model's points cover its surface. The distance to the nearest one says it
/// where they are laid out evenly; where they were drawn at random it would leave holes, and holes
/// have outlines that no measurement shows.
double covering_spacing_m(const Model& model) {
  Vec3d low, high;
  bounds(model, low, high);
  const double edge_m = kCounted * model.spacing_m;
  if (!(edge_m > 1e-5 * (high - low).norm())) return model.spacing_m;
  const std::size_t cells = count_cells(sort_by_cell(model, low, edge_m));
  const double even_m =
      edge_m * std::sqrt(static_cast<double>(cells) / static_cast<double>(model.size()));
  return model.spacing_m < kScattered * even_m ? kGapless * even_m : model.spacing_m;
}

/// The mean normal of the coarse points around shortens where they differ.
void find_flat(const Surface& fine, const Surface& coarse, std::span<std::uint8_t> flat) {
  const auto radius_m = static_cast<float>(kNormalReach * coarse.spacing_m);
  for (std::size_t i = 0; i < fine.size; ++i) {
    Vec3f sum = Vec3f::Zero();
    float count = 0.0F;
    for (std::size_t j = 0; j < coarse.size; ++j) {
      if ((coarse.point(j) - fine.point(i)).squaredNorm() > radius_m * radius_m) continue;
      sum += coarse.normal(j);
      count += 1.0F;
    }
    flat[i] = count > 0.0F && sum.norm() > kFlat * count ? 1 : 0;
  }
}

}  // namespace

FieldTable model_index_fields() noexcept {
  using P = ModelIndexParams;
  static constexpr std::array kFields = {
      number_field<&P::surface_points>("surface_points", "", 256, 60000,
                                       "model points for refinement and verification"),
      number_field<&P::table_voxels>("table_voxels", "", 4096, 16000000,
                                     "voxels of the model's closest-point table"),
      number_field<&P::samples>("samples", "", 64, 8192, "model points a quick rating looks at"),
  };
  return kFields;
}

void thin_model(const Model& model, double min_spacing_m, Surface& out) {
  Vec3d low, high;
  bounds(model, low, high);
  double edge_m = std::max(min_spacing_m, std::max((high - low).norm(), 1e-9) / 1000.0);
  std::vector<CellEntry> entries = sort_by_cell(model, low, edge_m);
  for (std::size_t cells = count_cells(entries); cells > out.capacity();
       cells = count_cells(entries)) {
    const double over = static_cast<double>(cells) / static_cast<double>(out.capacity());
    edge_m *= std::clamp(std::sqrt(over), 1.02, 1.5);
    entries = sort_by_cell(model, low, edge_m);
  }
  out.clear();
  for (std::size_t begin = 0, end = 0; begin < entries.size(); begin = end) {
    while (end < entries.size() && entries[end].key == entries[begin].key) ++end;
    append_mean(model, std::span(entries).subspan(begin, end - begin), out);
  }
  out.spacing_m = edge_m;
}

void ModelIndex::reserve(Arena& arena, const Model& model, const ModelIndexParams& params,
                         const Limits& limits, std::size_t descriptor_dimension) {
  const std::size_t fine_points = std::min(model.size(), params.surface_points);
  fine.reserve(arena, fine_points, 0);
  flat = arena.take<std::uint8_t>(fine_points);
  table.reserve(arena, params.table_voxels);
  coarse_table.reserve(arena, kCoarseVoxels);
  field.reserve(arena);
  samples.reserve(arena, params.samples);
  templates.reserve(arena, params.templates);
  coarse.reserve(arena, std::min(model.size(), limits.max_model_points), 0);
  siblings = FixedList<Sibling>(arena.take<Sibling>(kSiblings));
  mirrored = FixedList<Sibling>(arena.take<Sibling>(kSiblings));
  keypoints = KeypointSet(arena.take<Keypoint>(limits.max_keypoints));
  features.reserve(arena, limits.max_keypoints, descriptor_dimension);
}

void ModelIndex::build(const Model& model, const ModelIndexParams& params, double spacing_m) {
  // Cells finer than the file's own spacing would report a density that is not there.
  const double least_m = covering_spacing_m(model);
  thin_model(model, least_m, fine);
  thin_model(model, std::max(least_m, spacing_m), coarse);
  Vec3d low, high;
  bounds(model, low, high);
  centre = 0.5 * (low + high);
  diameter_m = (high - low).norm();
  symmetry = model.symmetry;
  closed = encloses_volume(fine);
  find_flat(fine, coarse, flat);
  table.build(fine, 0.15 * diameter_m);
  coarse_table.build(coarse, 0.15 * diameter_m);
  field.build(coarse, coarse_table, 0.1 * diameter_m, kFieldReach * diameter_m);
  samples.draw(fine, Rng(model.hash));
  templates.build(fine, params.templates);
  find_siblings(coarse, coarse_table, centre, diameter_m, symmetry, siblings);
  find_mirrored_siblings({fine, table, closed}, coarse, coarse_table, centre, diameter_m, symmetry,
                         mirrored);
}

}  // namespace grapnel
