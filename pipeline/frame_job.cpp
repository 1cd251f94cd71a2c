#include "pipeline/frame_job.h"

#include <algorithm>
#include <cmath>

#include "base/hash.h"
#include "pipeline/judge/verdict.h"

namespace grapnel {
namespace {

// The outline of a pose beside the object, and free space around it, must be inside of the box.
constexpr int kBoxMargin_px = 24;
// Match tolerance at the least: 4 mm at the scale of parcels, a hundredth of smaller parts.
constexpr double kFloor_m = 0.004;
constexpr double kFloorOfDiameter = 0.01;

std::uint64_t hash_of(const DepthFrame& frame, std::uint64_t seed) noexcept {
  for (int v = 0; v < frame.depth.height; ++v) {
    const std::span row(frame.depth.row(v), static_cast<std::size_t>(frame.depth.width));
    seed = hash_bytes(std::as_bytes(row), seed);
  }
  return seed;
}

}  // namespace

FrameJob::FrameJob(RegistrarState& state, const JobContext& context) noexcept
    : s_(state), context_(context), watch_(context, reports_), rng_(0) {}

Result<RegistrationReports> FrameJob::run(const DepthFrame& frame) noexcept {
  if (const Status status = prepare(frame); !status.ok()) return status.error();
  if (const Status status = find_objects(frame); !status.ok()) return status.error();

  const std::size_t looked_at =
      std::min(s_.components.size(), s_.stages.params.general.max_components);
  for (std::size_t i = 0; i < looked_at; ++i) {
    const Component& component = s_.components[i];
    const auto label = static_cast<std::uint8_t>(i + 1);
    const Status described = describe(frame, component, label);
    if (!described.ok()) {
      if (described.error().code == Code::TooFewPoints) continue;
      return described.error();
    }
    bool reported = false;
    if (const Status status = register_models(reported); !status.ok()) return status.error();
    if (reported) ++reports_.found;
  }
  rank();
  watch_.finish();
  return reports_;
}

Result<RegistrationReports> FrameJob::run(const Surface& scene) noexcept {
  const auto width = static_cast<std::size_t>(scene.grid.width);
  const auto height = static_cast<std::size_t>(scene.grid.height);
  if (width * height > s_.depth_of_cloud.size() || !scene.grid.intrinsics.valid()) {
    return Error{Code::CapacityExceeded, Stage::Organize, static_cast<std::int32_t>(width)};
  }
  float farthest = 0.0F;
  for (std::size_t i = 0; i < scene.size; ++i) farthest = std::max(farthest, scene.z[i]);
  if (!(farthest > 0.0F)) return Error{Code::TooFewPoints, Stage::Organize, 0};
  // Counts as fine as 16 bits allow.
  DepthFrame frame;
  frame.metres_per_unit = static_cast<double>(farthest) / 65000.0;
  frame.intrinsics = scene.grid.intrinsics;
  frame.intrinsics.width = scene.grid.width;
  frame.intrinsics.height = scene.grid.height;
  std::fill_n(s_.depth_of_cloud.begin(), width * height, std::uint16_t{0});
  for (std::size_t i = 0; i < scene.size; ++i) {
    const double counts = static_cast<double>(scene.z[i]) / frame.metres_per_unit + 0.5;
    if (!(counts >= 1.0)) continue;
    s_.depth_of_cloud[static_cast<std::size_t>(scene.grid.pixel_of[i])] =
        static_cast<std::uint16_t>(counts);
  }
  frame.depth = {s_.depth_of_cloud.data(), scene.grid.width, scene.grid.height};
  return run(frame);
}

Result<double> FrameJob::occupied_share(const DepthFrame& frame) noexcept {
  if (const Status status = prepare(frame); !status.ok()) return status.error();
  const double pixels = static_cast<double>(s_.work.depth.pixels());
  return pixels > 0.0 ? static_cast<double>(s_.background.foreground) / pixels : 0.0;
}

Status FrameJob::prepare(const DepthFrame& frame) noexcept {
  const std::uint64_t seed = hash_of(frame, s_.preset.fingerprint);
  reports_.seed = static_cast<std::uint32_t>(seed);
  rng_ = Rng(reports_.seed);

  if (const Status status = watch_.enter(Stage::Organize); !status.ok()) return status;
  const Result<std::size_t> kept = organize(frame, s_.stages.params.organize, s_.work);
  if (!kept.ok()) return kept.error();
  reports_.counts.target_points = static_cast<std::uint32_t>(kept.value());
  if (const Status status = watch_.enter(Stage::Outliers); !status.ok()) return status;
  s_.stages.outliers.apply(s_.work);
  if (const Status status = watch_.enter(Stage::Median); !status.ok()) return status;
  s_.stages.median.apply(s_.work);
  if (const Status status = watch_.enter(Stage::Background); !status.ok()) return status;
  double largest_m = 0.0;
  for (const ModelIndex& model : s_.models) largest_m = std::max(largest_m, model.diameter_m);
  Rng rng = rng_.split(1);
  s_.background = s_.stages.background.apply(s_.work, context_.background, largest_m, rng);
  return {};
}

Status FrameJob::find_objects(const DepthFrame&) noexcept {
  if (const Status status = watch_.enter(Stage::Segment); !status.ok()) return status;
  s_.stages.segment.apply(s_.work, s_.components);
  if (!s_.components.empty()) return {};
  return Error{Code::RoiEmpty, Stage::Segment, static_cast<std::int32_t>(s_.background.foreground)};
}

Status FrameJob::describe(const DepthFrame& frame, const Component& component,
                          std::uint8_t label) noexcept {
  if (const Status status = watch_.enter(Stage::Decimate); !status.ok()) return status;
  const Result<int> stride = decimate(s_.work, label, frame.color, s_.stages.params.decimate,
                                      s_.spacing_m, s_.object.surface);
  if (!stride.ok()) return stride.error();
  Surface& surface = s_.object.surface;

  if (const Status status = watch_.enter(Stage::Normals); !status.ok()) return status;
  if (const Status status = s_.stages.normals->estimate(surface); !status.ok()) return status;
  // Radii given in spacings must mean the same on the model and here.
  surface.spacing_m = s_.spacing_m;
  s_.object.samples.draw(surface, rng_.split(2));
  middle_ = Vec3d::Zero();
  for (std::size_t i = 0; i < surface.size; ++i) middle_ += surface.point(i).cast<double>();
  middle_ /= static_cast<double>(surface.size);

  if (const Status status = watch_.enter(Stage::Keypoints); !status.ok()) return status;
  if (!s_.stages.keypoints->detect(surface, s_.object.keypoints).ok()) s_.object.keypoints.clear();
  if (const Status status = watch_.enter(Stage::Descriptors); !status.ok()) return status;
  if (!s_.stages.descriptors->describe(surface, s_.object.keypoints.span(), s_.object.features)
           .ok()) {
    s_.object.features.rows = 0;
  }

  view_ = {};
  view_.intrinsics = s_.work.intrinsics;
  view_.depth = s_.work.depth;
  view_.metres_per_unit = static_cast<float>(s_.work.metres_per_unit);
  view_.label = s_.work.label;
  view_.object = label;
  view_.noise.sigma_per_m2 = static_cast<float>(s_.stages.params.general.sigma_1m_m);
  view_.working = &surface;
  view_.box = {std::max(0, component.left - kBoxMargin_px),
               std::max(0, component.top - kBoxMargin_px),
               std::min(view_.depth.width, component.right + kBoxMargin_px),
               std::min(view_.depth.height, component.bottom + kBoxMargin_px)};
  s_.edges.build(view_);
  return {};
}

MeasuredObject FrameJob::measured() noexcept {
  MeasuredObject object;
  object.surface = &s_.object.surface;
  object.samples = &s_.object.samples;
  object.keypoints = &s_.object.keypoints;
  object.features = &s_.object.features;
  object.view = &view_;
  object.edges = &s_.edges;
  object.middle = middle_;
  return object;
}

Status FrameJob::register_models(bool& reported) noexcept {
  RegistrationReport best;
  for (std::size_t i = 0; i < s_.models.size(); ++i) {
    if (i < 32 && (context_.model_mask >> i & 1U) == 0) continue;
    const double area_m2 =
        static_cast<double>(s_.object.surface.size) * s_.spacing_m * s_.spacing_m;
    const double diameter_m = s_.models[i].diameter_m;
    if (area_m2 < s_.stages.params.general.min_area_ratio * diameter_m * diameter_m) continue;
    RegistrationReport report;
    if (const Status status = register_model(i, report); !status.ok()) return status;
    const bool better = !reported || (report.accepted && !best.accepted) ||
                        (report.accepted == best.accepted && report.quality > best.quality);
    if (better) best = report;
    reported = true;
  }
  if (reported) reports_.objects.push_back(best);
  return {};
}

Status FrameJob::register_model(std::size_t model_i, RegistrationReport& report) noexcept {
  ModelIndex& model = s_.models[model_i];
  const MeasuredObject object = measured();
  report.model = static_cast<std::uint32_t>(model_i);
  report.symmetric = model.symmetry != Symmetry::None;
  report.counts.source_points = static_cast<std::uint32_t>(model.fine.size);
  report.counts.target_points = static_cast<std::uint32_t>(s_.object.surface.size);
  report.counts.source_keypoints = static_cast<std::uint32_t>(model.keypoints.size());
  report.counts.target_keypoints = static_cast<std::uint32_t>(s_.object.keypoints.size());
  Rng rng = rng_.split(100 + model_i);

  if (const Status status = watch_.enter(Stage::Match); !status.ok()) return status;
  if (!s_.stages.match->match(model.features, s_.object.features, s_.correspondences).ok()) {
    s_.correspondences.clear();
  }
  report.counts.correspondences = static_cast<std::uint32_t>(s_.correspondences.size());
  if (const Status status = watch_.enter(Stage::Reject); !status.ok()) return status;
  const PairView pair{&model.coarse, object.surface, model.keypoints.span(),
                      s_.object.keypoints.span()};
  if (!s_.stages.reject->reject(pair, s_.correspondences, rng).ok()) s_.correspondences.clear();
  report.counts.after_rejection = static_cast<std::uint32_t>(s_.correspondences.size());

  if (const Status status = watch_.enter(Stage::Coarse); !status.ok()) return status;
  const double floor_m = s_.stages.params.verdict.floor_m > 0.0
                             ? s_.stages.params.verdict.floor_m
                             : std::min(kFloor_m, kFloorOfDiameter * model.diameter_m);
  view_.noise.floor_m = static_cast<float>(floor_m / 3.0);
  s_.search.propose(model, object, s_.correspondences,
                    context_.has_initial ? &context_.initial : nullptr, rng);
  report.counts.hypotheses = static_cast<std::uint32_t>(s_.search.hypothesis_count());
  if (const Status status = watch_.enter(Stage::Refine); !status.ok()) return status;
  s_.search.settle(model, object);
  s_.search.verify(model, object, floor_m);
  if (const Status status = watch_.enter(Stage::Judge); !status.ok()) return status;
  judge(model_i, floor_m, report);
  report.budget_reached = s_.object.keypoints.overflowed() || s_.correspondences.overflowed() ||
                          model.keypoints.overflowed() || s_.components.overflowed();
  return {};
}

void FrameJob::judge(std::size_t model_i, double floor_m, RegistrationReport& report) noexcept {
  const ModelIndex& model = s_.models[model_i];
  Findings findings;
  findings.diameter_m = model.diameter_m;
  findings.tolerance_m = floor_m;
  if (!s_.search.candidates().empty()) {
    const Candidate& best = s_.search.candidates()[0];
    const Pose& pose = best.refined.target_from_source;
    report.has_pose = true;
    report.target_from_source = pose;
    report.iterations = best.refined.iterations;
    report.converged = best.refined.converged;
    findings.evidence = best.evidence;
    findings.margin = s_.search.margin(model);
    const auto z_m = static_cast<float>((pose * model.centre).z());
    const double sigma_m = static_cast<double>(view_.noise.sigma_m(z_m));
    findings.tolerance_m = std::max(3.0 * sigma_m, floor_m);
    const Intrinsics& grid = s_.object.surface.grid.intrinsics;
    const double pixels_per_point = view_.intrinsics.fx * view_.intrinsics.fy / (grid.fx * grid.fy);
    const double shared =
        std::max(1.0, s_.stages.params.general.shared_error_px / pixels_per_point);
    report.covariance = pose_covariance(best.refined, sigma_m, shared);
    Pose frame = pose * s_.grasp[model_i];
    if (s_.preset.models[model_i].grasps.front().required.empty()) {
      frame.translation() = pose * model.centre;
    }
    const Uncertainty uncertainty = uncertainty_at(report.covariance, frame, s_.required[model_i]);
    findings.sigma_m = uncertainty.sigma_m;
    findings.sigma_rad = uncertainty.sigma_rad;
    if (s_.background.plane_count > 0) {
      const DepthPlane& belt = s_.background.planes[0];
      double lowest_m = 1e9;
      for (std::size_t i = 0; i < model.fine.size; ++i) {
        const Vec3d p = pose * model.fine.point(i).cast<double>();
        lowest_m = std::min(lowest_m, belt.normal.dot(p) + belt.offset_m);
      }
      findings.has_belt = true;
      findings.belt_distance_m = lowest_m;
    }
  }
  pass_verdict(findings, s_.stages.params.verdict, report);
}

void FrameJob::rank() noexcept {
  std::stable_sort(reports_.objects.begin(), reports_.objects.end(),
                   [](const RegistrationReport& a, const RegistrationReport& b) {
                     if (a.accepted != b.accepted) return a.accepted;
                     return a.quality > b.quality;
                   });
  const std::size_t wanted =
      context_.max_objects > 0 ? context_.max_objects : s_.preset.max_objects;
  if (reports_.objects.size() > wanted) reports_.objects.resize(wanted);
  reports_.code = Code::RoiEmpty;
  if (reports_.objects.empty()) return;
  reports_.code = reports_.objects[0].code;
  reports_.counts = reports_.objects[0].counts;
}

}  // namespace grapnel
