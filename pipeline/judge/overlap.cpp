#include "pipeline/judge/overlap.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/judge/checks.h"
#include "pipeline/judge/motion_share.h"

namespace grapnel {
namespace {

constexpr double kSigmas = 3.0;
// A point whose surface is turned farther from the camera than 75 degrees is not expected.
constexpr float kCosFacing = 0.26F;
// Normals of a match differ by at most 35 degrees: 30, and the sensor's own noise.
constexpr float kCosNormal = 0.82F;
// Mixed pixels: this near to an edge of the depth image nothing is counted.
constexpr int kRim_px = 2;
// A step in depth of this share, and of this many sigmas, is an edge.
constexpr double kEdgeShare = 0.02;
constexpr double kEdgeSigmas = 6.0;
// Without a camera: points farther than this many spacings from the other cloud are outside of it.
constexpr double kNearSpacings = 4.0;

/// Sums about the middle of a view's points.
MotionSums sums_about_middle(const OverlapView& view, const Pose& pose) noexcept {
  if (view.spread.arm_m > 0.0) return {pose * view.spread.centre, view.spread.arm_m};
  const PointSpread spread = spread_of(*view.fine);
  return {pose * spread.centre, spread.arm_m};
}

double share(double part, double whole) noexcept { return whole > 0.0 ? part / whole : 0.0; }

/// Depth of a pixel, which has that point, 0 where there is none.
double depth_of(const Surface& surface, std::int32_t point) noexcept {
  return point < 0 ? 0.0 : static_cast<double>(surface.z[static_cast<std::size_t>(point)]);
}

/// Whether the depth jumps, or ends, beside a pixel that lies at least kRim_px within the grid.
bool at_edge(const Surface& raw, const std::int32_t* pixel, double z, double sigma_m) noexcept {
  const double step = std::max(kEdgeShare * z, kEdgeSigmas * sigma_m);
  const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(kRim_px) * raw.grid.width;
  const std::array<std::ptrdiff_t, 4> around = {kRim_px, -kRim_px, row, -row};
  return std::any_of(around.begin(), around.end(), [&](std::ptrdiff_t off) {
    const double other = depth_of(raw, pixel[off]);
    return !(other > 0.0) || std::fabs(other - z) > step;
  });
}

/// One direction of the test.
class Direction {
 public:
  Direction(const OverlapView& moved, const OverlapView& fixed, const Pose& pose,
            const OverlapTolerance& tolerance) noexcept
      : moved_(moved),
        fixed_(fixed),
        tolerance_(tolerance),
        rotation_(pose.linear().cast<float>()),
        shift_(pose.translation().cast<float>()),
        matched_(sums_about_middle(moved, pose)),
        contradicted_(matched_) {}

  OverlapEvidence run() noexcept {
    const Surface& points = *moved_.fine;
    const Surface& raw = *fixed_.raw;
    const bool camera = raw.organised() && raw.grid.intrinsics.valid() && raw.has_viewpoint;
    for (std::size_t i = 0; i < points.size; ++i) {
      if (!points.has_normal(i)) continue;
      evidence_.points += 1.0;
      const Vec3f p = rotation_ * points.point(i) + shift_;
      const Vec3f normal = rotation_ * points.normal(i);
      if (camera) {
        test_by_camera(p, normal);
      } else {
        test_by_distance(p, normal);
      }
    }
    MotionSums all = matched_;
    all.add(contradicted_);
    evidence_.least_share = least_matched_share(matched_, all);
    return evidence_;
  }

 private:
  void test_by_camera(const Vec3f& p, const Vec3f& normal) noexcept {
    const Surface& raw = *fixed_.raw;
    if (!(p.z() > 0.0F)) return;
    const float range = p.norm();
    const float cosine = -normal.dot(p) / range;
    if (cosine < kCosFacing) return;
    const Intrinsics& k = raw.grid.intrinsics;
    const double across = k.fx * static_cast<double>(p.x() / p.z()) + k.cx + 0.5;
    const double down = k.fy * static_cast<double>(p.y() / p.z()) + k.cy + 0.5;
    const int width = raw.grid.width;
    const int height = raw.grid.height;
    if (!(across >= 0.0 && down >= 0.0 && across < width && down < height)) return;
    const auto u = static_cast<int>(across);
    const auto v = static_cast<int>(down);
    const std::int32_t* const pixel =
        raw.grid.point_of.data() + static_cast<std::ptrdiff_t>(v) * width + u;
    const double z = depth_of(raw, *pixel);
    if (!(z > 0.0)) {
      evidence_.unknown += 1.0;
      return;
    }
    const bool inside = u >= kRim_px && v >= kRim_px && u + kRim_px < width && v + kRim_px < height;
    // Both views err: the variances add.
    const double sigma_m = tolerance_.sigma_per_m2 * z * z * std::sqrt(2.0);
    if (!inside || at_edge(raw, pixel, z, sigma_m)) return;
    const double off =
        (z - static_cast<double>(p.z())) * static_cast<double>(range / p.z() * cosine);
    const double limit = std::max(kSigmas * sigma_m, tolerance_.floor_m);
    if (off > limit) {
      evidence_.seen_through += 1.0;
      contradicted_.add(p, normal);
    } else if (off < -limit) {
      evidence_.hidden += 1.0;
    } else {
      match(p, normal, near(p), off);
    }
  }

  /// A point of the fixed view near a place, seldom the nearest one; -1 = none is near.
  std::int32_t near(const Vec3f& p) const noexcept {
    const std::int32_t found = fixed_.table->nearby(p);
    if (found < 0) return found;
    const Vec3f gap = fixed_.fine->point(static_cast<std::size_t>(found)) - p;
    const auto limit_m = static_cast<float>(kNearSpacings * fixed_.fine->spacing_m);
    return gap.squaredNorm() <= limit_m * limit_m ? found : -1;
  }

  void match(const Vec3f& p, const Vec3f& normal, std::int32_t partner, double off) noexcept {
    const Surface& fine = *fixed_.fine;
    const bool faces_elsewhere =
        partner >= 0 && fine.has_normal(static_cast<std::size_t>(partner)) &&
        fine.normal(static_cast<std::size_t>(partner)).dot(normal) < kCosNormal;
    if (faces_elsewhere) {
      misalign(p, normal);
      return;
    }
    evidence_.matched += 1.0;
    matched_.add(p, normal);
    evidence_.square_m2 += off * off;
  }

  void test_by_distance(const Vec3f& p, const Vec3f& normal) noexcept {
    const Surface& fine = *fixed_.fine;
    const std::int32_t found =
        fixed_.table->closest(p, static_cast<float>(kNearSpacings * fine.spacing_m));
    if (found < 0) {
      evidence_.hidden += 1.0;
      return;
    }
    const auto partner = static_cast<std::size_t>(found);
    const Vec3f offset = p - fine.point(partner);
    const double off = static_cast<double>(offset.dot(fine.normal(partner)));
    const double z =
        fixed_.raw->has_viewpoint ? static_cast<double>((p - fixed_.raw->viewpoint).norm()) : 0.0;
    const double limit =
        std::max(kSigmas * std::sqrt(2.0) * tolerance_.sigma_per_m2 * z * z, tolerance_.floor_m);
    if (std::fabs(off) > limit) {
      misalign(p, normal);
    } else {
      match(p, normal, found, off);
    }
  }

  void misalign(const Vec3f& p, const Vec3f& normal) noexcept {
    evidence_.misaligned += 1.0;
    contradicted_.add(p, normal);
  }

  const OverlapView& moved_;
  const OverlapView& fixed_;
  const OverlapTolerance& tolerance_;
  Eigen::Matrix3f rotation_;
  Vec3f shift_;
  MotionSums matched_;
  MotionSums contradicted_;
  OverlapEvidence evidence_;
};

}  // namespace

PointSpread spread_of(const Surface& surface) noexcept {
  PointSpread spread;
  spread.centre = centroid(surface);
  double square_m2 = 0.0;
  for (std::size_t i = 0; i < surface.size; ++i) {
    square_m2 += (surface.point(i).cast<double>() - spread.centre).squaredNorm();
  }
  const auto count = static_cast<double>(std::max<std::size_t>(1, surface.size));
  spread.arm_m = std::max(1e-9, std::sqrt(square_m2 / count));
  return spread;
}

double OverlapEvidence::matched_share() const noexcept {
  return share(matched, matched + misaligned + seen_through);
}
double OverlapEvidence::seen_through_share() const noexcept {
  return share(seen_through, matched + misaligned + seen_through);
}
double OverlapEvidence::overlap() const noexcept { return share(matched, points); }

OverlapEvidence test_overlap(const OverlapView& moved, const OverlapView& fixed,
                             const Pose& fixed_from_moved,
                             const OverlapTolerance& tolerance) noexcept {
  return Direction(moved, fixed, fixed_from_moved, tolerance).run();
}

double worth(const OverlapEvidence& forward, const OverlapEvidence& back) noexcept {
  const auto one = [](const OverlapEvidence& e) {
    return e.least_share * share(e.matched - e.misaligned - 2.0 * e.seen_through, e.points);
  };
  return one(forward) + one(back);
}

FieldTable overlap_fields() noexcept {
  using P = OverlapParams;
  static constexpr std::array kFields = {
      number_field<&P::min_matched>("min_matched", "", 0.0, 1.0,
                                    "matched share of the points that the other view should see"),
      number_field<&P::min_least_share>(
          "min_least_share", "", 0.0, 1.0,
          "the same, of the points that notice the motion which is confirmed least"),
      number_field<&P::min_overlap>("min_overlap", "", 0.0, 1.0, "matched share of all points"),
      number_field<&P::min_area_ratio>("min_area_ratio", "squared sizes", 0.0, 1.0,
                                       "matched surface"),
      number_field<&P::max_seen_through>(
          "max_seen_through", "", 0.0, 1.0,
          "share of those points that the other camera sees through"),
      number_field<&P::max_rmse_ratio>("max_rmse_ratio", "", 0.05, 1.0,
                                       "deviation of matched points, share of the tolerance"),
      number_field<&P::min_margin>("min_margin", "", 0.0, 1.0,
                                   "distance to the second-best distinct pose"),
      number_field<&P::max_sigma_ratio>("max_sigma_ratio", "sizes", 0.0, 1.0,
                                        "predicted deviation, weakest direction"),
      number_field<&P::max_sigma_m>("max_sigma_m", "m", 0.0, 1.0,
                                    "the same whatever the size; 0 = off"),
      number_field<&P::max_sigma_rad>("max_sigma_rad", "rad", 0.0, 1.0,
                                      "predicted deviation, weakest axis"),
  };
  return kFields;
}

void pass_overlap_verdict(const OverlapFindings& findings, const OverlapParams& params,
                          RegistrationReport& report) noexcept {
  const OverlapEvidence& forward = findings.forward;
  const OverlapEvidence& back = findings.back;
  const double matched = forward.matched + back.matched;
  report.fitness = std::min(forward.matched_share(), back.matched_share());
  report.coverage = std::min(forward.overlap(), back.overlap());
  report.free_space_violation = std::max(forward.seen_through_share(), back.seen_through_share());
  report.occluded = share(forward.hidden + back.hidden, forward.points + back.points);
  report.unknown = share(forward.unknown + back.unknown, forward.points + back.points);
  report.rmse_m = std::sqrt(share(forward.square_m2 + back.square_m2, matched));
  report.margin = findings.margin;
  report.sigma_m = findings.sigma_m;
  report.sigma_rad = findings.sigma_rad;

  Checks checks(report);
  const double area_m2 = 0.5 * matched * findings.spacing_m * findings.spacing_m;
  const double size_m = findings.size_m;
  checks.at_least(Check::MatchedShare, report.fitness, params.min_matched, 1.0);
  checks.at_least(Check::LeastShare, std::min(forward.least_share, back.least_share),
                  params.min_least_share, 1.0);
  checks.at_least(Check::Overlap, report.coverage, params.min_overlap, 1.0);
  checks.at_least(Check::MatchedArea, area_m2, params.min_area_ratio * size_m * size_m,
                  0.5 * size_m * size_m);
  checks.at_most(Check::SeenThrough, report.free_space_violation, params.max_seen_through);
  checks.at_most(Check::Deviation, report.rmse_m, params.max_rmse_ratio * findings.tolerance_m);
  checks.at_least(Check::Margin, findings.margin, params.min_margin, 1.0);
  const double most_m = params.max_sigma_ratio * size_m;
  checks.at_most(Check::Shift, findings.sigma_m,
                 params.max_sigma_m > 0.0 ? std::min(most_m, params.max_sigma_m) : most_m);
  checks.at_most(Check::Turn, findings.sigma_rad, params.max_sigma_rad);
  checks.conclude();
}

}  // namespace grapnel
