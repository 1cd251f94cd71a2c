#include "pipeline/judge/verification.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

namespace grapnel {
namespace {

constexpr float kSigmas = 3.0F;
// Normals of a match differ by at most 35 degrees: 30 of the model, and the sensor's own noise.
constexpr float kCosNormal = 0.82F;
// In sensor pixels. Mixed pixels: this far from the predicted outline nothing is counted.
constexpr int kRim_px = 2;
// An outline pixel is met by a depth edge this near.
constexpr int kEdgeReach_px = 3;
// Times the least step that counts as an edge.
constexpr float kSureStep = 1.5F;
// Beside the outline the object must have ended at this distance.
constexpr int kBeside_px = 6;

// Pixels of a row that are compared at once.
constexpr int kStretch_px = 64;

// A model of which less is in sight has not been looked at.
constexpr std::uint32_t kFewestPixels = 20;
constexpr double kOutOfSight = -3.0;

float tolerance_m(const DepthView& view, float z_m, double floor_m) noexcept {
  return std::max(kSigmas * view.noise.sigma_m(z_m), static_cast<float>(floor_m));
}

/// Pixel of a grid that looks along the same ray as pixel `at`; may lie outside of the grid.
int grid_pixel(int at, double c, double f, double grid_c, double grid_f) noexcept {
  return static_cast<int>(std::floor((at - c) * (grid_f / f) + grid_c + 0.5));
}

/// Pixels of the object under test in the view's box.
std::uint32_t object_pixels(const DepthView& view) noexcept {
  std::uint32_t count = 0;
  for (int v = view.box.v0; v < view.box.v1; ++v) {
    const std::uint16_t* depth = view.depth.row(v);
    if (view.label.empty()) {
      for (int u = view.box.u0; u < view.box.u1; ++u) count += depth[u] != 0 ? 1U : 0U;
      continue;
    }
    const std::uint8_t* label = view.label.row(v);
    const std::uint8_t wanted = view.object;
    for (int u = view.box.u0; u < view.box.u1; ++u) {
      const bool of_object = wanted == 0 ? label[u] != 0 : label[u] == wanted;
      count += depth[u] != 0 && of_object ? 1U : 0U;
    }
  }
  return count;
}

}  // namespace

struct Verification::Sums {
  std::array<std::uint32_t, static_cast<std::size_t>(Kind::kCount)> count{};
  double area_m2 = 0.0;
  double square_m2 = 0.0;
  std::array<double, 6> normals{};  ///< area times n nᵀ: xx, xy, xz, yy, yz, zz
  std::uint32_t own_unmatched = 0;  ///< object's pixels inside the outline nearer than the model
  std::uint32_t explained = 0;      ///< object's pixels on the model
};

/// Pixels of a row that are compared at once.
struct Verification::Stretch {
  static constexpr std::size_t kSize = kStretch_px + kernels::kComparePad;
  alignas(64) std::array<float, kSize> own_x, own_y, own_z;  // normals, the model's frame
  alignas(64) std::array<float, kSize> nx, ny, nz;           // the same, the camera's
  alignas(64) std::array<float, kSize> measured_m, off_m, footprint;
  alignas(64) std::array<std::int32_t, kSize> met;  // kernels::Met
};

double worth(const Evidence& evidence) noexcept {
  if (evidence.pixels < kFewestPixels) return kOutOfSight;
  return evidence.matched - 2.0 * evidence.seen_through -
         0.5 * std::min(1.0, evidence.unexplained) -
         0.5 * evidence.edge_known * (1.0 - evidence.edge);
}

void Verification::reserve(Arena& arena, std::size_t max_pixels, std::size_t max_model_points) {
  kind_ = arena.take<Kind>(max_pixels);
  stack_ = arena.take<std::int32_t>(max_pixels);
  confirmed_ = arena.take<std::uint8_t>(max_model_points);
}

int Verification::rim_of(const Surface& model, const ModelRender& render,
                         const DepthView& view) noexcept {
  // At the model's own edges discs stand over.
  const float disc_px = disc_radius_m(model) * static_cast<float>(view.intrinsics.fx) /
                        std::max(render.nearest_m(), 1e-3F);
  return std::max(view.own_px(kRim_px), static_cast<int>(disc_px) + 1);
}

void Verification::working_columns(const DepthView& view, const PixelBox& box) noexcept {
  if (view.working == nullptr || !view.working->organised()) return;
  const Intrinsics& grid = view.working->grid.intrinsics;
  for (int u = box.u0; u < box.u1; ++u) {
    const int column = grid_pixel(u, view.intrinsics.cx, view.intrinsics.fx, grid.cx, grid.fx);
    stack_[static_cast<std::size_t>(u - box.u0)] =
        column >= 0 && column < view.working->grid.width ? column : -1;
  }
}

void Verification::compare(const Surface& model, const ModelRender& render, const DepthView& view,
                           int u, int v, int count, Stretch& stretch) const noexcept {
  const float* const z = render.depths(u, v);
  const std::int32_t* const points = render.points(u, v);
  const std::uint16_t* const depth = view.depth.row(v) + u;
  const std::uint8_t* const label = view.label.empty() ? nullptr : view.label.row(v) + u;
  const auto size = static_cast<std::size_t>(count);
  for (std::size_t k = 0; k < size; ++k) {
    const auto i = static_cast<std::size_t>(z[k] > 0.0F ? points[k] : 0);
    stretch.own_x[k] = model.nx[i];
    stretch.own_y[k] = model.ny[i];
    stretch.own_z[k] = model.nz[i];
    const float measured = view.metres_per_unit * static_cast<float>(depth[k]);
    stretch.measured_m[k] = label != nullptr && label[k] == 0 ? -measured : measured;
  }
  kernels::CompareLaw law = law_;
  law.first_x = static_cast<float>((u - view.intrinsics.cx) / view.intrinsics.fx);
  law.y = static_cast<float>((v - view.intrinsics.cy) / view.intrinsics.fy);
  const kernels::PredictedRow predicted{z, render.box().width(), stretch.own_x.data(),
                                        stretch.own_y.data(), stretch.own_z.data()};
  kernels::compare_row(predicted, stretch.measured_m.data(), size, motion_, law,
                       {stretch.met.data(), stretch.off_m.data(), stretch.footprint.data(),
                        stretch.nx.data(), stretch.ny.data(), stretch.nz.data()});
}

void Verification::cut_off(const ModelRender& render, int u, int v, int count,
                           Stretch& stretch) const noexcept {
  const PixelBox& box = render.box();
  const int rim = law_.rim_px;
  const bool row_whole = v - rim >= box.v0 && v + rim < box.v1;
  const int begin = row_whole ? std::clamp(box.u0 + rim - u, 0, count) : count;
  const int end = row_whole ? std::clamp(box.u1 - rim - u, begin, count) : count;
  const auto mark = [&](int first, int last) {
    for (int c = first; c < last; ++c) {
      const bool there = render.z_m(u + c, v) > 0.0F;
      stretch.met[static_cast<std::size_t>(c)] =
          static_cast<std::int32_t>(there ? kernels::Met::AtStep : kernels::Met::Nothing);
    }
  };
  mark(0, begin);
  mark(end, count);
}

bool Verification::faces_elsewhere(const DepthView& view, std::int32_t working,
                                   const Stretch& stretch, std::size_t k) const noexcept {
  const auto w = static_cast<std::size_t>(working);
  if (!view.working->has_normal(w)) return false;
  return view.working->nx[w] * stretch.nx[k] + view.working->ny[w] * stretch.ny[k] +
             view.working->nz[w] * stretch.nz[k] <
         kCosNormal;
}

void Verification::classify(const ModelRender& render, const DepthView& view, int u, int v,
                            int count, const Stretch& stretch, Sums& sums) noexcept {
  using kernels::Met;
  const PixelBox& box = render.marked();
  const std::int32_t* const points = render.points(u, v);
  const std::int32_t* grid = nullptr;
  if (view.working != nullptr && view.working->organised()) {
    const Intrinsics& own = view.working->grid.intrinsics;
    const int row = grid_pixel(v, view.intrinsics.cy, view.intrinsics.fy, own.cy, own.fy);
    if (row >= 0 && row < view.working->grid.height) {
      grid = view.working->grid.point_of.data() +
             static_cast<std::ptrdiff_t>(row) * view.working->grid.width;
    }
  }
  float area = 0.0F;
  float square = 0.0F;
  std::array<float, 6> normals{};
  for (int c = 0; c < count; ++c) {
    const auto k = static_cast<std::size_t>(c);
    Kind kind = Kind::Outside;
    switch (static_cast<Met>(stretch.met[k])) {
      case Met::Nothing:
        break;
      case Met::AtStep: {
        const float limit = tolerance_m(view, render.z_m(u + c, v), law_.floor_m);
        const bool explained = explained_at_rim(render, view, u + c, v, law_.rim_px, limit);
        kind = explained ? Kind::Rim : Kind::Stray;
        if (view.of_object(u + c, v)) ++sums.explained;
        break;
      }
      case Met::NoReading:
        kind = Kind::Unknown;
        break;
      // The ground touches the part: says nothing for it. Farther away it is free space.
      case Met::Ground:
        kind = Kind::Support;
        break;
      case Met::Behind:
        kind = Kind::SeenThrough;
        break;
      case Met::Before:
        kind = Kind::Occluded;
        if (view.of_object(u + c, v)) {
          kind = Kind::InFront;
          ++sums.own_unmatched;
        } else if (view.of_fragment(u + c, v)) {
          kind = Kind::InFront;
        }
        break;
      case Met::Within: {
        const auto i = static_cast<std::size_t>(points[k]);
        if (grid != nullptr && flat_[i] != 0) {
          const std::int32_t column = stack_[static_cast<std::size_t>(u + c - box.u0)];
          const std::int32_t working = column >= 0 ? grid[column] : -1;
          if (working >= 0 && faces_elsewhere(view, working, stretch, k)) {
            kind = Kind::Occluded;
            break;
          }
        }
        kind = Kind::Matched;
        confirmed_[i] = 1;
        if (view.of_object(u + c, v)) ++sums.explained;
        const float weight = stretch.footprint[k];
        area += weight;
        square += stretch.off_m[k] * stretch.off_m[k];
        const float wx = weight * stretch.nx[k];
        const float wy = weight * stretch.ny[k];
        normals[0] += wx * stretch.nx[k];
        normals[1] += wx * stretch.ny[k];
        normals[2] += wx * stretch.nz[k];
        normals[3] += wy * stretch.ny[k];
        normals[4] += wy * stretch.nz[k];
        normals[5] += weight * stretch.nz[k] * stretch.nz[k];
        break;
      }
    }
    kind_[render.index(u + c, v)] = kind;
    ++sums.count[static_cast<std::size_t>(kind)];
  }
  sums.area_m2 += static_cast<double>(area);
  sums.square_m2 += static_cast<double>(square);
  for (std::size_t i = 0; i < 6; ++i) sums.normals[i] += static_cast<double>(normals[i]);
}

void Verification::outline(const ModelRender& render, const DepthView& view, const EdgeMap& edges,
                           Evidence& evidence) const noexcept {
  const int reach = view.own_px(kEdgeReach_px);
  const auto beside = static_cast<float>(view.own_px(kBeside_px));
  std::uint32_t visible = 0;
  std::uint32_t known = 0;
  std::uint32_t met = 0;
  std::uint32_t runs_on = 0;
  std::uint32_t on_belt = 0;
  for (const ContourPoint& point : render.contour()) {
    const int u = static_cast<int>(std::floor(point.u + 0.5F));
    const int v = static_cast<int>(std::floor(point.v + 0.5F));
    if (!view.box.contains(u, v)) continue;
    const float predicted = render.z_m(u, v);
    const float measured = view.z_m(u, v);
    const float step =
        predicted > 0.0F ? 8.0F * view.noise.sigma_m(predicted) + 0.01F * predicted : 0.0F;
    // Hidden behind something nearer: the outline can't be seen there.
    if (predicted > 0.0F && measured > 0.0F && measured < predicted - step) continue;
    const int bu = static_cast<int>(std::floor(point.u + beside * point.out_u + 0.5F));
    const int bv = static_cast<int>(std::floor(point.v + beside * point.out_v + 0.5F));
    const bool inside = view.box.contains(bu, bv);
    // A step of the part itself that is too low to be seen for certain.
    const float beyond = inside ? render.z_m(bu, bv) : 0.0F;
    if (predicted > 0.0F && beyond > 0.0F &&
        beyond - predicted < kSureStep * edge_step_m(view, predicted)) {
      continue;
    }
    ++visible;
    if (inside && view.on_belt(bu, bv, step)) ++on_belt;
    if (edges.nearest(u, v, reach).found) {
      ++known;
      ++met;
      continue;
    }
    // Without a reading inside or beside, nobody can say whether the part ends here.
    if (!inside || !(measured > 0.0F) || !(view.z_m(bu, bv) > 0.0F)) continue;
    ++known;
    if (view.of_object(bu, bv) && std::fabs(view.z_m(bu, bv) - measured) < step) ++runs_on;
  }
  if (visible > 0) {
    evidence.edge_known = static_cast<double>(known) / static_cast<double>(visible);
    evidence.beside_belt = static_cast<double>(on_belt) / static_cast<double>(visible);
  }
  if (known == 0) return;
  evidence.edge = static_cast<double>(met) / static_cast<double>(known);
  evidence.unexplained += static_cast<double>(runs_on) / static_cast<double>(visible);
}

Evidence Verification::verify(const Surface& model, std::span<const std::uint8_t> flat,
                              const Pose& camera_from_model, const ModelRender& render,
                              const DepthView& view, const EdgeMap& edges, double floor_m,
                              bool whole) noexcept {
  Evidence evidence;
  flat_ = flat;
  motion_ = kernels::motion_of(camera_from_model);
  law_.sigmas = kSigmas;
  law_.sigma_per_m2 = view.noise.sigma_per_m2;
  law_.sigma_floor_m = view.noise.floor_m;
  law_.floor_m = static_cast<float>(floor_m);
  law_.rim_px = rim_of(model, render, view);
  law_.step_x = static_cast<float>(1.0 / view.intrinsics.fx);
  std::fill_n(confirmed_.begin(), model.size, std::uint8_t{0});
  Sums sums;
  Stretch stretch;
  const PixelBox& box = render.marked();
  working_columns(view, box);
  for (int v = box.v0; v < box.v1; ++v) {
    for (int u = box.u0; u < box.u1; u += kStretch_px) {
      const int count = std::min(kStretch_px, box.u1 - u);
      if (v - law_.rim_px >= render.box().v0 && v + law_.rim_px < render.box().v1) {
        compare(model, render, view, u, v, count, stretch);
      }
      cut_off(render, u, v, count, stretch);
      classify(render, view, u, v, count, stretch, sums);
    }
  }
  const auto count = [&](Kind kind) {
    return static_cast<double>(sums.count[static_cast<std::size_t>(kind)]);
  };
  const double matched = count(Kind::Matched);
  const double occluded = count(Kind::Occluded) + count(Kind::InFront);
  const double total = matched + count(Kind::SeenThrough) + occluded + count(Kind::Unknown);
  evidence.pixels = static_cast<std::uint32_t>(total);
  if (total < 1.0) return evidence;
  evidence.matched = matched / total;
  evidence.seen_through = count(Kind::SeenThrough) / total;
  evidence.occluded = occluded / total;
  evidence.unknown = count(Kind::Unknown) / total;
  sums.area_m2 /= view.intrinsics.fx * view.intrinsics.fy;
  for (double& sum : sums.normals) sum /= view.intrinsics.fx * view.intrinsics.fy;
  evidence.matched_area_m2 = sums.area_m2;
  if (matched > 0.0) {
    evidence.rmse_m = std::sqrt(sums.square_m2 / matched);
    evidence.unexplained = static_cast<double>(sums.own_unmatched) / matched;
    // Share of matched area whose normal differs from the main one: by the trace of n nᵀ.
    const auto& n = sums.normals;
    Mat3d share;
    share << n[0], n[1], n[2], n[1], n[3], n[4], n[2], n[4], n[5];
    share /= sums.area_m2;
    const double main = Eigen::SelfAdjointEigenSolver<Mat3d>(share).eigenvalues()[2];
    evidence.second_face = 1.0 - main;
  } else {
    evidence.unexplained = 1.0;
  }
  outline(render, view, edges, evidence);
  if (!whole) return evidence;
  const std::uint32_t object = object_pixels(view);
  evidence.explained =
      object == 0 ? 0.0 : static_cast<double>(sums.explained) / static_cast<double>(object);
  if (count(Kind::SeenThrough) > 0.0) {
    evidence.hole_area_m2 =
        largest_piece_m2(Kind::SeenThrough, Kind::SeenThrough, box, render, view);
  }
  if (count(Kind::Stray) > 0.0) {
    evidence.stray_area_m2 = broad_piece_m2(Kind::Stray, box, render, view);
  }
  if (count(Kind::InFront) > 0.0) {
    evidence.stray_area_m2 =
        std::max(evidence.stray_area_m2, broad_piece_m2(Kind::InFront, box, render, view));
  }
  std::size_t confirmed = 0;
  for (std::size_t i = 0; i < model.size; ++i) confirmed += confirmed_[i];
  evidence.coverage = static_cast<double>(confirmed) / static_cast<double>(model.size);
  return evidence;
}

}  // namespace grapnel
