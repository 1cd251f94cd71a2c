#include "pipeline/judge/ground_beside.h"

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

// In sensor pixels: beside the outline the part has ended here, and a projector's shadow here.
constexpr int kBeside_px = 6;
constexpr int kShadow_px = 32;
// An outline pixel is met by a depth edge this near.
constexpr int kEdgeReach_px = 3;
// The camera looks under a part where the ground would be hidden by this much more than the edge's
// reach, if the part went on down to it.
constexpr int kUnder_px = kBeside_px + 2;
// What a part ends with below: this share of its height.
constexpr double kUnderside = 0.1;
// A reading belongs to what meets the part's side when it is within this many times the distance
// that its pixels are apart: the other surface may be seen as flat as 15 degrees.
constexpr double kFlat = 4.0;

Vec3f seen_at(const DepthView& view, int u, int v) noexcept {
  const float z = view.z_m(u, v);
  return {static_cast<float>((u - view.intrinsics.cx) / view.intrinsics.fx) * z,
          static_cast<float>((v - view.intrinsics.cy) / view.intrinsics.fy) * z, z};
}

double height_of(const DepthPlane& belt, const Vec3f& point) noexcept {
  return belt.normal.dot(point.cast<double>()) + belt.offset_m;
}

}  // namespace

void GroundSearch::reserve(Arena& arena, std::size_t max_contour) {
  places_ = arena.take<Place>(max_contour);
  heights_ = arena.take<float>(max_contour);
}

bool GroundSearch::look_beside(const ModelRender& render, const DepthView& view,
                               const ContourPoint& point, Place& place) noexcept {
  const int last = view.own_px(kShadow_px);
  for (int k = view.own_px(kBeside_px); k <= last; ++k) {
    const auto step = static_cast<float>(k);
    const int u = static_cast<int>(std::floor(point.u + step * point.out_u + 0.5F));
    const int v = static_cast<int>(std::floor(point.v + step * point.out_v + 0.5F));
    if (u < 0 || v < 0 || u >= view.depth.width || v >= view.depth.height) return true;
    // A step of the part itself is no outline of it.
    if (view.box.contains(u, v) && render.z_m(u, v) > 0.0F) return false;
    if (view.depth.at(u, v) == 0) continue;
    place.beside = seen_at(view, u, v);
    place.height_m = static_cast<float>(height_of(*view.belt, place.beside));
    place.found = true;
    return true;
  }
  return true;
}

void GroundSearch::collect(const Surface& model, const Pose& camera_from_model,
                           const ModelRender& render, const DepthView& view,
                           const EdgeMap& edges) noexcept {
  const Eigen::Matrix3f rotation = camera_from_model.linear().cast<float>();
  const Vec3f shift = camera_from_model.translation().cast<float>();
  const int reach = view.own_px(kEdgeReach_px);
  size_ = 0;
  for (const ContourPoint& point : render.contour()) {
    if (size_ == places_.size()) return;
    const int u = static_cast<int>(std::floor(point.u + 0.5F));
    const int v = static_cast<int>(std::floor(point.v + 0.5F));
    if (!view.box.contains(u, v)) continue;
    Place place;
    const auto i = static_cast<std::size_t>(point.point);
    place.point = rotation * model.point(i) + shift;
    place.normal = rotation * model.normal(i);
    // Hidden behind something nearer.
    const float z = place.point.z();
    const float measured = view.z_m(u, v);
    if (measured > 0.0F && measured < z - edge_step_m(view, z)) continue;
    if (!look_beside(render, view, point, place)) continue;
    place.met = edges.nearest(u, v, reach).found;
    place.out_u = point.out_u;
    place.out_v = point.out_v;
    places_[size_++] = place;
  }
}

void GroundSearch::find_level(double tolerance_m, GroundBeside& ground) noexcept {
  std::size_t count = 0;
  for (const Place& place : places_.first(size_)) {
    if (place.found) heights_[count++] = place.height_m;
  }
  if (count == 0) return;
  std::sort(heights_.begin(), heights_.begin() + static_cast<std::ptrdiff_t>(count));
  const auto band_m = static_cast<float>(2.0 * tolerance_m);
  std::size_t most = 0;
  std::size_t end = 0;
  for (std::size_t begin = 0; begin < count; ++begin) {
    while (end < count && heights_[end] - heights_[begin] <= band_m) ++end;
    if (end - begin <= most) continue;
    most = end - begin;
    ground.level_m = static_cast<double>(heights_[begin + most / 2]);
  }
  ground.share = static_cast<double>(most) / static_cast<double>(size_);
}

bool GroundSearch::borne_at(const Place& place, const DepthView& view, double level_m,
                            double lowest_m, double highest_m, double tolerance_m) noexcept {
  if (!place.found) return false;
  const auto height_m = static_cast<double>(place.height_m);
  const double footprint_m = static_cast<double>(place.beside.z()) / view.intrinsics.fx;
  if (height_m > level_m + tolerance_m) {
    if (std::fabs(height_m - lowest_m) <= tolerance_m) return true;
    const Vec3f apart = place.beside - place.point;
    const double reach_m = kFlat * view.own_px(kBeside_px) * footprint_m + tolerance_m;
    return static_cast<double>(place.normal.dot(apart)) > tolerance_m &&
           static_cast<double>(apart.norm()) <= reach_m;
  }
  const double own_m = height_of(*view.belt, place.point);
  if (!place.met || height_m < level_m - tolerance_m ||
      own_m > lowest_m + kUnderside * (highest_m - lowest_m) + tolerance_m) {
    return false;
  }
  // Where the ground right below this point appears.
  const Vec3d below = place.point.cast<double>() - (own_m - level_m) * view.belt->normal;
  if (!(below.z() > 0.0)) return false;
  const Vec3d x = place.point.cast<double>();
  const double du = view.intrinsics.fx * (below.x() / below.z() - x.x() / x.z());
  const double dv = view.intrinsics.fy * (below.y() / below.z() - x.y() / x.z());
  return static_cast<double>(place.out_u) * du + static_cast<double>(place.out_v) * dv >=
         view.own_px(kUnder_px);
}

GroundBeside GroundSearch::look(const Surface& model, const Pose& camera_from_model,
                                const ModelRender& render, const DepthView& view,
                                const EdgeMap& edges, double lowest_m, double highest_m,
                                double tolerance_m) noexcept {
  GroundBeside ground;
  if (view.belt == nullptr) return ground;
  collect(model, camera_from_model, render, view, edges);
  if (size_ == 0) return ground;
  find_level(tolerance_m, ground);
  std::size_t borne = 0;
  for (const Place& place : places_.first(size_)) {
    if (borne_at(place, view, ground.level_m, lowest_m, highest_m, tolerance_m)) ++borne;
  }
  ground.borne = static_cast<double>(borne) / static_cast<double>(size_);
  return ground;
}

}  // namespace grapnel
