#include "pipeline/surface_grasp.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/math.h"
#include "pipeline/neighbours/symmetric3.h"

namespace grapnel {
namespace {

// Pixels across a footprint's radius, at the most: some 300 in all.
constexpr int kAcross = 10;
// A reading this many times the allowed deviation off the plane does not fill the footprint.
constexpr double kOff = 3.0;
// A millimetre of deviation is worth this many of height.
constexpr double kHeightForFlatness = 4.0;
// Every pixel of this lattice counts for the object's length.
constexpr int kLength_px = 3;

/// Readings in a disc about a point.
struct Footprint {
  Vec3d mean = Vec3d::Zero();
  Vec3d normal = Vec3d::Zero();  ///< unit, toward the camera
  double deviation_m = 0.0;
  double filled = 0.0;
};

struct Moments {
  Vec3d sum = Vec3d::Zero();
  Symmetric3 square;
  double count = 0.0;

  /// About `origin`, so that numbers stay small.
  void add(const Vec3d& offset) noexcept {
    sum += offset;
    square.add(offset.x(), offset.y(), offset.z());
    count += 1.0;
  }
  [[nodiscard]] Eigen3 axes() const noexcept {
    return eigen_symmetric3(square.over(count).about(sum / count));
  }
};

class Finder {
 public:
  Finder(const GraspScene& scene, const SurfaceGraspParams& params) noexcept
      : work_(*scene.work), label_(scene.label), params_(params) {}

  [[nodiscard]] Vec3d ray(int u, int v) const noexcept {
    const Intrinsics& k = work_.intrinsics;
    return {(u - k.cx) / k.fx, (v - k.cy) / k.fy, 1.0};
  }

  /// The disc about `centre` on the plane with `normal`; false when nearly nothing is in it.
  bool look(const Vec3d& centre, const Vec3d& normal, Footprint& footprint) const noexcept {
    const Intrinsics& k = work_.intrinsics;
    const double radius_px = params_.radius_m * k.fx / centre.z();
    const int step = std::max(1, static_cast<int>(radius_px) / kAcross);
    const int reach = static_cast<int>(1.5 * radius_px) / step * step;
    const int u0 = static_cast<int>(k.fx * centre.x() / centre.z() + k.cx + 0.5);
    const int v0 = static_cast<int>(k.fy * centre.y() / centre.z() + k.cy + 0.5);
    const double offset = normal.dot(centre);
    Moments moments;
    double wanted = 0.0;
    for (int v = v0 - reach; v <= v0 + reach; v += step) {
      for (int u = u0 - reach; u <= u0 + reach; u += step) {
        const Vec3d direction = ray(u, v);
        const double along = normal.dot(direction);
        if (!(along < -0.1)) continue;
        const Vec3d on_plane = direction * (offset / along);
        if ((on_plane - centre).squaredNorm() > params_.radius_m * params_.radius_m) continue;
        wanted += 1.0;
        const bool inside = u >= 0 && v >= 0 && u < work_.depth.width && v < work_.depth.height;
        if (!inside || work_.label.at(u, v) != label_) continue;
        const Vec3d off = direction * work_.depth_m(u, v) - centre;
        if (std::fabs(normal.dot(off)) <= kOff * params_.max_deviation_m) moments.add(off);
      }
    }
    if (moments.count < 6.0) return false;
    const Eigen3 axes = moments.axes();
    footprint.normal = axes.vectors.col(0);
    if (footprint.normal.dot(centre) > 0.0) footprint.normal = -footprint.normal;
    footprint.mean = centre + moments.sum / moments.count;
    footprint.deviation_m = std::sqrt(std::max(0.0, axes.values[0]));
    footprint.filled = moments.count / wanted;
    return true;
  }

  /// Main direction of all of the object's readings.
  [[nodiscard]] Vec3d length() const noexcept {
    Moments moments;
    const Vec3d origin(0.0, 0.0, 1.0);
    for (int v = 0; v < work_.label.height; v += kLength_px) {
      for (int u = 0; u < work_.label.width; u += kLength_px) {
        if (work_.label.at(u, v) == label_) moments.add(ray(u, v) * work_.depth_m(u, v) - origin);
      }
    }
    if (moments.count < 3.0) return Vec3d::UnitX();
    return moments.axes().vectors.col(2);
  }

 private:
  const WorkingDepth& work_;
  std::uint8_t label_;
  const SurfaceGraspParams& params_;
};

/// The best footprint, and of all the fullest and, of the full ones, the flattest: for the reasons.
struct Search {
  bool found = false;
  Footprint best;
  double worth = 0.0;
  double filled = 0.0;
  double flattest_m = 1.0;
};

Search search(const GraspScene& scene, const SurfaceGraspParams& params,
              const Finder& finder) noexcept {
  Search result;
  const Surface& surface = *scene.surface;
  const Vec3d& up = scene.belt->normal;
  const double least_cosine = math::cos(params.max_slope_rad);
  for (std::size_t i = 0; i < surface.size; ++i) {
    if (!surface.has_normal(i)) continue;
    const Vec3d centre = surface.point(i).cast<double>();
    const Vec3d normal = surface.normal(i).cast<double>();
    if (up.dot(centre) + scene.belt->offset_m < params.min_height_m) continue;
    if (up.dot(normal) < least_cosine) continue;
    Footprint first;
    Footprint footprint;
    // A normal of few points is rough: the disc is laid on its own plane once more.
    if (!finder.look(centre, normal, first) || !finder.look(centre, first.normal, footprint)) {
      continue;
    }
    result.filled = std::max(result.filled, footprint.filled);
    if (footprint.filled < params.min_filled || up.dot(footprint.normal) < least_cosine) continue;
    result.flattest_m = std::min(result.flattest_m, footprint.deviation_m);
    if (footprint.deviation_m > params.max_deviation_m) continue;
    const double worth = up.dot(footprint.mean) - kHeightForFlatness * footprint.deviation_m;
    if (result.found && worth <= result.worth) continue;
    result.found = true;
    result.worth = worth;
    result.best = footprint;
  }
  return result;
}

/// Height of the object's highest readings above the belt; one in a hundred may be higher.
double top_m(const GraspScene& scene) noexcept {
  constexpr double kStep_m = 0.005;
  std::array<std::uint32_t, 400> histogram{};
  for (std::size_t i = 0; i < scene.surface->size; ++i) {
    const double height_m =
        scene.belt->normal.dot(scene.surface->point(i).cast<double>()) + scene.belt->offset_m;
    const double bin = std::clamp(height_m / kStep_m, 0.0, 399.0);
    ++histogram[static_cast<std::size_t>(bin)];
  }
  std::size_t above = 0;
  for (std::size_t bin = histogram.size(); bin-- > 0;) {
    above += histogram[bin];
    if (100 * above > scene.surface->size) return kStep_m * static_cast<double>(bin + 1);
  }
  return 0.0;
}

Pose frame_at(const Footprint& footprint, const Vec3d& length) noexcept {
  const Vec3d into = -footprint.normal;
  Vec3d along = length - into * into.dot(length);
  if (along.norm() < 1e-3) along = Vec3d::UnitX() - into * into.x();
  along.normalize();
  if (along.x() < 0.0) along = -along;
  Pose pose = Pose::Identity();
  pose.linear().col(0) = along;
  pose.linear().col(1) = into.cross(along);
  pose.linear().col(2) = into;
  pose.translation() = footprint.mean;
  return pose;
}

void fail(Check check, double measured, double limit, RegistrationReport& report) noexcept {
  report.measured[check] = static_cast<float>(measured);
  (void)report.reasons.push_back({check, measured, limit});
}

/// The object may be the part at all: whole, no larger, no higher.
bool plausible(const GraspScene& scene, const SurfaceGraspParams& params,
               RegistrationReport& report) noexcept {
  const std::size_t before = report.reasons.size();
  if (!scene.whole) fail(Check::GraspWhole, 1.0, 0.0, report);
  if (scene.area_m2 > params.max_size_ratio * scene.model_area_m2) {
    fail(Check::GraspSize, scene.area_m2 / scene.model_area_m2, params.max_size_ratio, report);
  }
  const double least_m2 = params.min_size_ratio * scene.model_area_m2;
  if (scene.area_m2 < least_m2) fail(Check::MatchedArea, scene.area_m2, least_m2, report);
  const double limit_m = params.max_height_ratio * scene.model_thickness_m;
  const double height_m = top_m(scene);
  if (height_m > limit_m) fail(Check::GraspHeight, height_m, limit_m, report);
  return report.reasons.size() == before;
}

}  // namespace

FieldTable surface_grasp_fields() noexcept {
  using P = SurfaceGraspParams;
  static constexpr std::array kFields = {
      bool_field<&P::enabled>(
          "enabled", "where no model fits, report a grasp on the object's top: DECISION 2"),
      number_field<&P::radius_m>("radius_m", "m", 0.005, 0.5, "of the footprint that is flat"),
      number_field<&P::min_filled>("min_filled", "", 0.5, 1.0,
                                   "share of the footprint that the object fills"),
      number_field<&P::max_deviation_m>("max_deviation_m", "m", 0.0005, 0.1,
                                        "deviation of the footprint's readings from their plane"),
      number_field<&P::max_slope_rad>("max_slope_rad", "rad", 0.0, 1.2,
                                      "of the footprint against the belt"),
      number_field<&P::min_height_m>("min_height_m", "m", 0.0, 10.0,
                                     "of the footprint above the belt"),
      number_field<&P::max_height_ratio>(
          "max_height_ratio", "", 0.5, 10.0,
          "height of the object over the model's least extent; a higher one is something else"),
      number_field<&P::min_size_ratio>(
          "min_size_ratio", "", 0.0, 1.0,
          "size of the object over the model's largest view; a smaller one is something else"),
      number_field<&P::max_size_ratio>(
          "max_size_ratio", "", 0.5, 10.0,
          "size of the object over the model's largest view; a larger one is something else"),
  };
  return kFields;
}

void grasp_surface(const GraspScene& scene, const SurfaceGraspParams& params,
                   RegistrationReport& report) noexcept {
  if (scene.belt == nullptr) {
    fail(Check::BeltKnown, 0.0, 1.0, report);
    return;
  }
  if (!plausible(scene, params, report)) return;
  const Finder finder(scene, params);
  const Search result = search(scene, params, finder);
  if (!result.found) {
    const bool full = result.filled >= params.min_filled && result.flattest_m < 1.0;
    if (full) {
      fail(Check::GraspFlat, result.flattest_m, params.max_deviation_m, report);
    } else {
      fail(Check::GraspPatch, std::min(result.filled, params.min_filled - 0.01), params.min_filled,
           report);
    }
    return;
  }
  report.surface_grasp = true;
  report.target_from_grasp = frame_at(result.best, finder.length());
  report.code = Code::SurfaceGrasp;
}

double least_extent_m(const Surface& model) noexcept {
  double least = 1e9;
  for (const std::span<float>* axis : {&model.x, &model.y, &model.z}) {
    if (model.size == 0) return 0.0;
    const auto [low, high] =
        std::minmax_element(axis->begin(), axis->begin() + static_cast<std::ptrdiff_t>(model.size));
    least = std::min(least, static_cast<double>(*high - *low));
  }
  return least;
}

}  // namespace grapnel
