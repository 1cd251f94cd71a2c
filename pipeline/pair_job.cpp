#include "pipeline/pair_job.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/insertion_sort.h"
#include "pipeline/coarse/hypothesis_list.h"
#include "pipeline/judge/covariance.h"
#include "pipeline/judge/overlap_information.h"
#include "pipeline/pair_views.h"
#include "pipeline/refine/normal_equations.h"

namespace grapnel {
namespace {

// Fine points are this much denser than the described ones.
constexpr double kFinePerCoarse = 0.4;
// Windows of the fine points' normals, in their distances.
constexpr double kWindowPerFine = 4.0;
// Described points are at least this far apart, in mean distances of the sparser view's points.
constexpr double kCoarsePerSparse = 1.25;
// Match tolerance at the least: 4 mm at the scale of parcels, a hundredth of smaller things.
constexpr double kFloor_m = 0.004;
constexpr double kFloorOfSize = 0.01;
// Proposals this near are one, in sizes: less than coarse refinement bridges.
constexpr double kSame = 0.03;
// Refined poses this near have ended in one place, in sizes.
constexpr double kEnded = 0.01;
// A first test looks at every fourth point…
constexpr std::size_t kGlanceStep = 4;
// …and poses below this share of the best one's worth can't become its rivals by finer refinement.
constexpr double kAlternative = 0.4;
// With fewer proposals nobody has looked for a rival of the pose they led to.
constexpr std::size_t kFewestProposals = 4;

/// The same surface with another unit of distances.
Surface with_spacing(const Surface& surface, double spacing_m) noexcept {
  Surface other = surface;
  other.spacing_m = spacing_m;
  return other;
}

}  // namespace

PairJob::PairJob(RegistrarState& state, const JobContext& context) noexcept
    : s_(state), p_(state.pair), context_(context), watch_(context, reports_), rng_(0) {}

Result<RegistrationReports> PairJob::run(const Surface& source, const Surface& target) noexcept {
  if (source.size < 10 || target.size < 10) return Error{Code::TooFewPoints, Stage::Organize, 0};
  measure(source, p_.source);
  measure(target, p_.target);
  size_m_ = std::min(p_.source.size_m, p_.target.size_m);
  centre_ = p_.source.centre;
  if (!(size_m_ > 0.0)) return Error{Code::TooFewPoints, Stage::Organize, 1};
  const GeneralParams& general = s_.stages.params.general;
  const double wanted_m =
      general.spacing_m > 0.0 ? general.spacing_m : general.spacing_ratio * size_m_;
  if (const Status status = watch_.enter(Stage::Decimate); !status.ok()) return status.error();
  for (const auto& [raw, view] : {std::pair(&source, &p_.source), std::pair(&target, &p_.target)}) {
    const Status status = thin(*raw, kFinePerCoarse * wanted_m, *view);
    if (!status.ok()) return status.error();
  }
  // Normals of a file and ones turned away from a cloud's centre need not face the same way.
  const bool one_side = (p_.source.own_normals || source.has_viewpoint) &&
                        (p_.target.own_normals || target.has_viewpoint);
  if (!one_side) p_.source.own_normals = p_.target.own_normals = false;
  reports_.seed = static_cast<std::uint32_t>(
      hash_of(p_.target.fine, hash_of(p_.source.fine, s_.preset.fingerprint)));
  rng_ = Rng(reports_.seed);
  // A cloud may be sparser than what its size asks for.
  const double sparsest_m = std::max(p_.source.fine.spacing_m, p_.target.fine.spacing_m);
  const double spacing_m = std::max(wanted_m, kCoarsePerSparse * sparsest_m);
  for (ViewIndex* view : {&p_.source, &p_.target}) {
    if (const Status status = prepare(spacing_m, *view); !status.ok()) return status.error();
  }
  if (const Status status = describe(p_.source, 1); !status.ok()) return status.error();
  if (const Status status = describe(p_.target, 2); !status.ok()) return status.error();

  RegistrationReport report;
  if (const Status status = match(report); !status.ok()) return status.error();
  if (const Status status = watch_.enter(Stage::Coarse); !status.ok()) return status.error();
  propose();
  report.counts.hypotheses = static_cast<std::uint32_t>(p_.proposed.size());
  if (const Status status = watch_.enter(Stage::Refine); !status.ok()) return status.error();
  settle();
  verify(source, target);
  if (const Status status = watch_.enter(Stage::Judge); !status.ok()) return status.error();
  judge(source, target, report);
  reports_.found = report.has_pose ? 1 : 0;
  reports_.code = report.code;
  reports_.counts = report.counts;
  reports_.objects.push_back(report);
  watch_.finish();
  return reports_;
}

Status PairJob::thin_to(double leaf_m, Surface& out) noexcept {
  const auto thinned = p_.voxel.apply(p_.work, leaf_m, 0);
  // A leaf made for a far smaller view may be too fine for this one's extent.
  const bool too_fine = !thinned.ok() && thinned.error().code == Code::BadParameter;
  if (!thinned.ok() && !too_fine) return thinned.error();
  if (too_fine || p_.work.size > out.capacity()) {
    const auto fewer = p_.voxel.apply(p_.work, 0.0, out.capacity());
    if (!fewer.ok()) return fewer.error();
  }
  if (!copy_points(p_.work, out)) {
    return Error{Code::CapacityExceeded, Stage::Decimate, static_cast<std::int32_t>(p_.work.size)};
  }
  out.spacing_m = std::max(leaf_m, p_.work.spacing_m);
  return {};
}

Status PairJob::thin(const Surface& raw, double fine_m, ViewIndex& view) noexcept {
  view.own_normals = any_normal(raw);
  const int stride = stride_for(raw, view.centre, fine_m);
  view.has_normals = false;
  const bool attributes = view.own_normals || any_set(raw.intensity, raw.size);
  // Single readings scatter too much: there thinned points have the better normals.
  if (stride > 1 && p_.grid.take(raw, stride, fine_m, attributes, p_.work)) {
    const double window_m = kWindowPerFine * std::max(fine_m, p_.work.spacing_m);
    const double at_m = (view.centre - raw.viewpoint.cast<double>()).norm();
    view.has_normals = p_.grid.normals(window_m, at_m, p_.work);
  } else if (!copy_points(raw, p_.work)) {
    return Error{Code::CapacityExceeded, Stage::Decimate, static_cast<std::int32_t>(raw.size)};
  }
  return thin_to(fine_m, view.fine);
}

Status PairJob::prepare(double spacing_m, ViewIndex& view) noexcept {
  if (const Status status = watch_.enter(Stage::Decimate); !status.ok()) return status;
  (void)copy_points(view.fine, p_.work);  // fits: it came from there
  if (const Status status = thin_to(spacing_m, view.coarse); !status.ok()) return status;
  view.coarse.spacing_m = spacing_m;
  if (const Status status = watch_.enter(Stage::Normals); !status.ok()) return status;
  if (!view.has_normals) {
    const Status status = s_.renew_normals(view.fine, view.own_normals);
    if (!status.ok()) return status;
  }
  if (const Status status = s_.renew_normals(view.coarse, view.own_normals); !status.ok()) {
    return status;
  }
  view.table.build_within(view.fine, 6.0 * spacing_m);
  return {};
}

Status PairJob::describe(ViewIndex& view, std::uint64_t stream) noexcept {
  view.samples.draw(view.coarse, rng_.split(stream));
  if (const Status status = watch_.enter(Stage::Keypoints); !status.ok()) return status;
  const bool by_features = s_.stages.coarse->needs_correspondences();
  if (!by_features || !s_.stages.keypoints->detect(view.coarse, view.keypoints).ok()) {
    view.keypoints.clear();
  }
  if (const Status status = watch_.enter(Stage::Descriptors); !status.ok()) return status;
  if (!by_features ||
      !s_.stages.descriptors->describe(view.coarse, view.keypoints.span(), view.features).ok()) {
    view.features.rows = 0;
  }
  return {};
}

Status PairJob::match(RegistrationReport& report) noexcept {
  report.counts.source_points = static_cast<std::uint32_t>(p_.source.coarse.size);
  report.counts.target_points = static_cast<std::uint32_t>(p_.target.coarse.size);
  report.counts.source_keypoints = static_cast<std::uint32_t>(p_.source.keypoints.size());
  report.counts.target_keypoints = static_cast<std::uint32_t>(p_.target.keypoints.size());
  if (const Status status = watch_.enter(Stage::Match); !status.ok()) return status;
  if (!s_.stages.match->match(p_.source.features, p_.target.features, s_.correspondences).ok()) {
    s_.correspondences.clear();
  }
  report.counts.correspondences = static_cast<std::uint32_t>(s_.correspondences.size());
  if (const Status status = watch_.enter(Stage::Reject); !status.ok()) return status;
  const PairView pair{&p_.source.coarse, &p_.target.coarse, p_.source.keypoints.span(),
                      p_.target.keypoints.span()};
  Rng rng = rng_.split(3);
  if (!s_.stages.reject->reject(pair, s_.correspondences, rng).ok()) s_.correspondences.clear();
  report.counts.after_rejection = static_cast<std::uint32_t>(s_.correspondences.size());
  report.budget_reached = p_.source.keypoints.overflowed() || p_.target.keypoints.overflowed() ||
                          s_.correspondences.overflowed();
  return {};
}

PoseScore PairJob::rating(double tolerance_m) const noexcept {
  PoseScore::Scene scene;
  scene.table = &p_.target.table;
  scene.surface = &p_.target.fine;
  scene.samples = &p_.target.samples;
  return {{&p_.source.samples, &p_.source.table, &p_.source.fine},
          scene,
          static_cast<float>(tolerance_m)};
}

void PairJob::propose() noexcept {
  p_.proposed.clear();
  const PoseScore score = rating(s_.stages.params.search.coarse_tolerance_ratio * size_m_);
  if (context_.has_initial) {
    keep_best(p_.proposed, {context_.initial, score(context_.initial, SIZE_MAX)});
  }
  const PairView pair{&p_.source.coarse, &p_.target.coarse, p_.source.keypoints.span(),
                      p_.target.keypoints.span(), &score};
  Rng rng = rng_.split(4);
  // Without consensus there is nothing to refine, and the verdict says so.
  (void)s_.stages.coarse->generate(pair, s_.correspondences, rng, p_.proposed);
}

Result<RefinedPose> PairJob::refine(PoseRefiner& refiner, const Surface& moving, double spacing_m,
                                    const Pose& target_from_source) noexcept {
  return refiner.refine(moving, with_spacing(p_.target.fine, spacing_m), p_.target.table,
                        target_from_source);
}

bool PairJob::distinct(const Pose& a, const Pose& b) const noexcept {
  return displacement_m(a, b, centre_, 0.5 * size_m_) >
         s_.stages.params.search.distinct_ratio * size_m_;
}

void PairJob::settle() noexcept {
  p_.settled.clear();
  const double spacing_m = p_.target.coarse.spacing_m;
  const PoseScore score = rating(0.5 * s_.stages.params.search.coarse_tolerance_ratio * size_m_);
  std::size_t starts = 0;
  for (std::size_t i = 0; i < p_.proposed.size(); ++i) {
    const Hypothesis hypothesis = p_.proposed[i];
    // Of poses that end in one place the best suffices.
    const auto same = [&](const Hypothesis& better) {
      return displacement_m(better.target_from_source, hypothesis.target_from_source, centre_,
                            0.5 * size_m_) < kSame * size_m_;
    };
    const std::span<const Hypothesis> before = p_.proposed.span().first(starts);
    if (std::any_of(before.begin(), before.end(), same)) continue;
    p_.proposed[starts++] = hypothesis;
    const Result<RefinedPose> refined = refine(*s_.stages.refine_coarse, p_.source.coarse,
                                               spacing_m, hypothesis.target_from_source);
    if (!refined.ok()) continue;
    Hypothesis settled;
    settled.target_from_source = refined.value().target_from_source;
    settled.support = score(settled.target_from_source, SIZE_MAX);
    bool merged = false;
    for (Hypothesis& other : p_.settled) {
      if (distinct(settled.target_from_source, other.target_from_source)) continue;
      merged = true;
      if (settled.support > other.support) other = settled;
      break;
    }
    if (!merged) keep_best(p_.settled, settled);
  }
}

void PairJob::keep_candidate(const PairCandidate& candidate) noexcept {
  for (PairCandidate& other : p_.candidates) {
    if (distinct(candidate.refined.target_from_source, other.refined.target_from_source)) continue;
    if (candidate.worth > other.worth) other = candidate;
    return;
  }
  p_.candidates.push_back(candidate);
}

void PairJob::verify(const Surface& source, const Surface& target) noexcept {
  p_.candidates.clear();
  const OverlapTolerance tolerance{s_.stages.params.general.sigma_1m_m,
                                   std::min(kFloor_m, kFloorOfSize * size_m_)};
  const OverlapView source_view{&source, &p_.source.fine, &p_.source.table,
                                spread_of(p_.source.fine)};
  const OverlapView target_view{&target, &p_.target.fine, &p_.target.table,
                                spread_of(p_.target.fine)};
  const Surface some_source = every_nth(p_.source.fine, kGlanceStep, 0, p_.work);
  const Surface some_target = every_nth(p_.target.fine, kGlanceStep, some_source.size, p_.work);
  OverlapView source_glance = source_view;
  source_glance.fine = &some_source;
  OverlapView target_glance = target_view;
  target_glance.fine = &some_target;
  const auto test = [&](const OverlapView& source_points, const OverlapView& target_points,
                        PairCandidate& candidate) {
    const Pose& pose = candidate.refined.target_from_source;
    candidate.forward = test_overlap(source_points, target_view, pose, tolerance);
    candidate.back = test_overlap(target_points, source_view, pose.inverse(), tolerance);
    candidate.worth = worth(candidate.forward, candidate.back);
  };
  double best = 0.0;
  for (const Hypothesis& hypothesis : p_.settled) {
    const Result<RefinedPose> refined =
        refine(*s_.stages.refine, p_.source.fine, p_.target.coarse.spacing_m,
               hypothesis.target_from_source);
    if (!refined.ok()) continue;
    PairCandidate candidate;
    candidate.refined = refined.value();
    // Of starts that end in one place the first, which is the best of them, suffices.
    const auto same = [&](const PairCandidate& other) {
      return displacement_m(candidate.refined.target_from_source, other.refined.target_from_source,
                            centre_, 0.5 * size_m_) < kEnded * size_m_;
    };
    if (std::any_of(p_.candidates.begin(), p_.candidates.end(), same)) continue;
    test(source_glance, target_glance, candidate);
    if (best == 0.0 || candidate.worth > kAlternative * best) {
      // Once more with the fine points' own distance as the unit.
      const Result<RefinedPose> finer =
          refine(*s_.stages.refine, p_.source.fine, p_.target.fine.spacing_m,
                 refined.value().target_from_source);
      if (finer.ok()) candidate.refined = finer.value();
      test(source_view, target_view, candidate);
      best = std::max(best, candidate.worth);
    }
    keep_candidate(candidate);
  }
  insertion_sort(p_.candidates.begin(), p_.candidates.end(),
                 [](const PairCandidate& a, const PairCandidate& b) { return a.worth > b.worth; });
}

ReadingErrors PairJob::reading_errors(const Surface& target, double z_m,
                                      double sigma_m) const noexcept {
  ReadingErrors errors;
  errors.sigma_m = sigma_m;
  const Intrinsics& camera = target.grid.intrinsics;
  if (!target.organised() || !camera.valid()) return errors;
  const GeneralParams& general = s_.stages.params.general;
  const double pixel_m2 = z_m * z_m / (camera.fx * camera.fy);
  const double spacing_m = p_.source.fine.spacing_m;
  errors.readings_per_error =
      std::max(1.0, general.pose_error_px * pixel_m2 / (spacing_m * spacing_m));
  // Both views err.
  errors.common_lateral_m = general.common_error_px * std::sqrt(2.0 * pixel_m2);
  errors.common_depth_m = general.common_error_sigmas * sigma_m;
  return errors;
}

Margin PairJob::margin() const noexcept {
  if (p_.candidates.empty() || !(p_.candidates[0].worth > 0.0)) return {0.0, nullptr};
  for (std::size_t i = 1; i < p_.candidates.size(); ++i) {
    if (!distinct(p_.candidates[i].refined.target_from_source,
                  p_.candidates[0].refined.target_from_source)) {
      continue;
    }
    return {1.0 - std::max(0.0, p_.candidates[i].worth) / p_.candidates[0].worth,
            &p_.candidates[i].refined.target_from_source};
  }
  const bool looked_for = context_.has_initial || p_.proposed.size() >= kFewestProposals;
  return {looked_for ? 1.0 : 0.0, nullptr};
}

void PairJob::judge(const Surface& source, const Surface& target,
                    RegistrationReport& report) noexcept {
  OverlapFindings findings;
  findings.size_m = size_m_;
  findings.spacing_m = std::max(p_.source.fine.spacing_m, p_.target.fine.spacing_m);
  findings.tolerance_m = std::min(kFloor_m, kFloorOfSize * size_m_);
  if (!p_.candidates.empty()) {
    const PairCandidate& best = p_.candidates[0];
    const Pose& pose = best.refined.target_from_source;
    report.has_pose = true;
    report.target_from_source = pose;
    report.iterations = best.refined.iterations;
    report.converged = best.refined.converged;
    findings.forward = best.forward;
    findings.back = best.back;
    const Margin ahead = margin();
    findings.margin = ahead.value;
    report.has_rival = ahead.rival != nullptr && ahead.value < s_.stages.params.overlap.min_margin;
    if (report.has_rival) report.target_from_rival = *ahead.rival;
    const bool cameras = source.has_viewpoint && target.has_viewpoint;
    const double z_m = cameras ? (pose * centre_ - target.viewpoint.cast<double>()).norm() : 0.0;
    const double sigma_m =
        std::max(s_.stages.params.general.sigma_1m_m * z_m * z_m * std::sqrt(2.0),
                 findings.tolerance_m / 3.0);
    findings.tolerance_m = std::max(3.0 * sigma_m, findings.tolerance_m);
    const OverlapView fixed{&target, &p_.target.fine, &p_.target.table, {}};
    const Mat6d information =
        overlap_information(p_.source.fine, fixed, pose, 2.0 * p_.target.fine.spacing_m);
    report.covariance = pose_covariance(information, reading_errors(target, z_m, sigma_m));
    Pose frame = Pose::Identity();
    frame.translation() = pose * centre_;
    const Uncertainty uncertainty =
        uncertainty_at(report.covariance, frame, required_directions({}, Symmetry::None));
    findings.sigma_m = uncertainty.sigma_m;
    findings.sigma_rad = uncertainty.sigma_rad;
  }
  pass_overlap_verdict(findings, s_.stages.params.overlap, report);
}

}  // namespace grapnel
