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

// A piece along an edge is at least this wide: mixed pixels make narrower ones.
constexpr int kPieceWidth_px = 4;
// Neighbouring predictions nearer to each other than this many tolerances are one steep surface.
constexpr float kSteep = 4.0F;

// A model of which less is in sight has not been looked at.
constexpr std::uint32_t kFewestPixels = 20;
constexpr double kOutOfSight = -3.0;

/// Sensor pixels in the view's own, rounded up.
int in_view(const DepthView& view, int sensor_px) noexcept {
  return (sensor_px + view.stride - 1) / view.stride;
}

float tolerance_m(const DepthView& view, float z_m, double floor_m) noexcept {
  return std::max(kSigmas * view.noise.sigma_m(z_m), static_cast<float>(floor_m));
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
  Mat3d normals = Mat3d::Zero();
  std::uint32_t own_unmatched = 0;  ///< object's pixels inside the outline nearer than the model
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

bool Verification::explained_at_rim(const ModelRender& render, const DepthView& view, int u, int v,
                                    int rim, float limit_m) const noexcept {
  const float measured = view.z_m(u, v);
  if (!(measured > 0.0F) || std::fabs(measured - render.z_m(u, v)) <= limit_m) return true;
  const bool of_object = view.of_object(u, v);
  // Something else in front.
  if (!of_object && measured < render.z_m(u, v)) return true;
  const auto predicted = [&](int pu, int pv) {
    return view.box.contains(pu, pv) ? render.z_m(pu, pv) : 0.0F;
  };
  for (int dv = -rim; dv <= rim; ++dv) {
    for (int du = -rim; du <= rim; ++du) {
      const float here = predicted(u + du, v + dv);
      if (!(here > 0.0F)) {
        if (!of_object) return true;
        continue;
      }
      if (std::fabs(measured - here) <= limit_m) return true;
      for (const float next : {predicted(u + du + 1, v + dv), predicted(u + du, v + dv + 1)}) {
        const bool steep = next > 0.0F && std::fabs(next - here) <= kSteep * limit_m;
        if (steep && measured > std::min(here, next) && measured < std::max(here, next)) {
          return true;
        }
      }
    }
  }
  return false;
}

double Verification::broad_piece_m2(Kind of, const PixelBox& box, const ModelRender& render,
                                    const DepthView& view) noexcept {
  const int width = std::max(2, in_view(view, kPieceWidth_px));
  for (int v = box.v0; v + width <= box.v1; ++v) {
    for (int u = box.u0; u + width <= box.u1; ++u) {
      bool whole = kind_[render.index(u, v)] == of;
      for (int dv = 0; whole && dv < width; ++dv) {
        for (int du = 0; whole && du < width; ++du) {
          whole = kind_[render.index(u + du, v + dv)] == of;
        }
      }
      if (whole) kind_[render.index(u, v)] = Kind::Piece;
    }
  }
  return largest_piece_m2(Kind::Piece, of, box, render, view);
}

double Verification::left_over_m2(const LeftOver& left_over, const ModelRender& render,
                                  const DepthView& view) noexcept {
  for (int v = view.box.v0; v < view.box.v1; ++v) {
    for (int u = view.box.u0; u < view.box.u1; ++u) {
      kind_[render.index(u, v)] = left_over(u, v) ? Kind::LeftOver : Kind::Outside;
    }
  }
  return broad_piece_m2(Kind::LeftOver, view.box, render, view);
}

Verification::Kind Verification::classify(const Surface& model, const ModelRender& render,
                                          const DepthView& view, int u, int v, double floor_m,
                                          Sums& sums) noexcept {
  const float predicted = render.z_m(u, v);
  const float limit = tolerance_m(view, predicted, floor_m);
  // At the model's own edges discs stand over.
  const auto disc_px =
      static_cast<int>(disc_radius_m(model) * static_cast<float>(view.intrinsics.fx) / predicted);
  const int rim = std::max(in_view(view, kRim_px), disc_px + 1);
  if (render.at_step(u, v, rim, limit)) {
    return explained_at_rim(render, view, u, v, rim, limit) ? Kind::Rim : Kind::Stray;
  }
  const float measured = view.z_m(u, v);
  if (!(measured > 0.0F)) return Kind::Unknown;

  const auto i = static_cast<std::size_t>(render.point(u, v));
  const Vec3f normal = rotation_ * model.normal(i);
  const Vec3f ray(static_cast<float>((u - view.intrinsics.cx) / view.intrinsics.fx),
                  static_cast<float>((v - view.intrinsics.cy) / view.intrinsics.fy), 1.0F);
  const float cosine = std::max(0.17F, -normal.dot(ray) / ray.norm());
  // Measured point from the predicted one along the model's normal, positive behind the surface.
  const float off = (measured - predicted) * ray.norm() * cosine;
  const double footprint_m2 = static_cast<double>(predicted * predicted / cosine) /
                              (view.intrinsics.fx * view.intrinsics.fy);
  if (view.background(u, v)) {
    // The ground touches the part: says nothing for it. Farther away it is free space.
    return off > limit ? Kind::SeenThrough : (off < -limit ? Kind::Occluded : Kind::Support);
  }
  if (off > limit) return Kind::SeenThrough;
  if (off < -limit) {
    if (view.of_object(u, v)) ++sums.own_unmatched;
    return Kind::Occluded;
  }
  const std::int32_t working = view.working_point(u, v);
  if (working >= 0 && flat_[i] != 0) {
    const auto w = static_cast<std::size_t>(working);
    if (view.working->has_normal(w) && view.working->normal(w).dot(normal) < kCosNormal) {
      return Kind::Occluded;
    }
  }
  const auto residual = static_cast<double>(off);
  sums.square_m2 += residual * residual;
  sums.area_m2 += footprint_m2;
  const Vec3d n = normal.cast<double>();
  sums.normals += footprint_m2 * n * n.transpose();
  confirmed_[i] = 1;
  return Kind::Matched;
}

double Verification::largest_piece_m2(Kind seed, Kind of, const PixelBox& box,
                                      const ModelRender& render, const DepthView& view) noexcept {
  double largest_m2 = 0.0;
  for (int v = box.v0; v < box.v1; ++v) {
    for (int u = box.u0; u < box.u1; ++u) {
      if (kind_[render.index(u, v)] != seed) continue;
      double area_m2 = 0.0;
      std::size_t top = 0;
      stack_[top++] = v * 65536 + u;
      kind_[render.index(u, v)] = Kind::Outside;
      while (top > 0) {
        const std::int32_t pixel = stack_[--top];
        const int pu = pixel % 65536;
        const int pv = pixel / 65536;
        const float predicted = render.z_m(pu, pv);
        const auto z = static_cast<double>(predicted > 0.0F ? predicted : view.z_m(pu, pv));
        area_m2 += z * z / (view.intrinsics.fx * view.intrinsics.fy);
        constexpr std::array<std::array<int, 2>, 4> kAround = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
        for (const auto& [du, dv] : kAround) {
          if (!box.contains(pu + du, pv + dv)) continue;
          Kind& kind = kind_[render.index(pu + du, pv + dv)];
          if (kind != seed && kind != of) continue;
          kind = Kind::Outside;
          stack_[top++] = (pv + dv) * 65536 + pu + du;
        }
      }
      largest_m2 = std::max(largest_m2, area_m2);
    }
  }
  return largest_m2;
}

void Verification::outline(const ModelRender& render, const DepthView& view, const EdgeMap& edges,
                           Evidence& evidence) const noexcept {
  const int reach = in_view(view, kEdgeReach_px);
  const auto beside = static_cast<float>(in_view(view, kBeside_px));
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
    const EdgeMap::Nearest edge = edges.nearest(u, v);
    if (edge.found && edge.square <= reach * reach) {
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
                              const DepthView& view, const EdgeMap& edges,
                              double floor_m) noexcept {
  Evidence evidence;
  flat_ = flat;
  rotation_ = camera_from_model.linear().cast<float>();
  shift_ = camera_from_model.translation().cast<float>();
  std::fill_n(confirmed_.begin(), model.size, std::uint8_t{0});
  Sums sums;
  std::uint32_t explained = 0;
  const PixelBox& box = render.marked();
  for (int v = box.v0; v < box.v1; ++v) {
    for (int u = box.u0; u < box.u1; ++u) {
      Kind kind = Kind::Outside;
      if (render.z_m(u, v) > 0.0F) {
        kind = classify(model, render, view, u, v, floor_m, sums);
      }
      kind_[render.index(u, v)] = kind;
      ++sums.count[static_cast<std::size_t>(kind)];
      const bool on_model = kind == Kind::Matched || kind == Kind::Rim || kind == Kind::Stray;
      if (on_model && view.of_object(u, v)) ++explained;
    }
  }
  const auto count = [&](Kind kind) {
    return static_cast<double>(sums.count[static_cast<std::size_t>(kind)]);
  };
  const double matched = count(Kind::Matched);
  const double total =
      matched + count(Kind::SeenThrough) + count(Kind::Occluded) + count(Kind::Unknown);
  evidence.pixels = static_cast<std::uint32_t>(total);
  if (total < 1.0) return evidence;
  evidence.matched = matched / total;
  evidence.seen_through = count(Kind::SeenThrough) / total;
  evidence.occluded = count(Kind::Occluded) / total;
  evidence.unknown = count(Kind::Unknown) / total;
  evidence.matched_area_m2 = sums.area_m2;
  if (matched > 0.0) {
    evidence.rmse_m = std::sqrt(sums.square_m2 / matched);
    evidence.unexplained = static_cast<double>(sums.own_unmatched) / matched;
    // Share of matched area whose normal differs from the main one: by the trace of n nᵀ.
    const Mat3d share = sums.normals / sums.area_m2;
    const double main = Eigen::SelfAdjointEigenSolver<Mat3d>(share).eigenvalues()[2];
    evidence.second_face = 1.0 - main;
  } else {
    evidence.unexplained = 1.0;
  }
  const std::uint32_t object = object_pixels(view);
  evidence.explained =
      object == 0 ? 0.0 : static_cast<double>(explained) / static_cast<double>(object);
  evidence.hole_area_m2 = largest_piece_m2(Kind::SeenThrough, Kind::SeenThrough, box, render, view);
  evidence.stray_area_m2 = broad_piece_m2(Kind::Stray, box, render, view);
  outline(render, view, edges, evidence);
  std::size_t confirmed = 0;
  for (std::size_t i = 0; i < model.size; ++i) confirmed += confirmed_[i];
  evidence.coverage = static_cast<double>(confirmed) / static_cast<double>(model.size);
  return evidence;
}

}  // namespace grapnel
