#include "pipeline/frame_job.h"

#include <algorithm>
#include <cmath>

#include "base/hash.h"
#include "pipeline/judge/verdict.h"

namespace grapnel {
namespace {

// The outline of a pose beside the object, and free space around it, must be inside of the box.
constexpr double kBoxMargin = 0.2;  // diameters
// Pixels of the view that poses are tested in, diameters: about 120 across a part.
constexpr double kViewPitch = 0.008;
// Match tolerance at the least: 4 mm at the scale of parcels, a fiftieth of small parts.
constexpr double kFloor_m = 0.004;
constexpr double kFloorOfDiameter = 0.02;

std::uint64_t hash_of(const DepthFrame& frame, std::uint64_t seed) noexcept {
  // Every reading has its noise: a few rows tell frames apart.
  constexpr int kStep = 4;
  for (int v = 0; v < frame.depth.height; v += kStep) {
    const std::span row(frame.depth.row(v), static_cast<std::size_t>(frame.depth.width));
    seed = hash_bytes(std::as_bytes(row), seed);
  }
  return seed;
}

}  // namespace

FrameJob::FrameJob(RegistrarState& state, const JobContext& context) noexcept
    : s_(state), context_(context), objects_(reports_), watch_(context, reports_), rng_(0) {
  for (const ModelIndex& model : s_.models) {
    if (smallest_diameter_m_ == 0.0 || model.diameter_m < smallest_diameter_m_) {
      smallest_diameter_m_ = model.diameter_m;
    }
  }
}

Result<RegistrationReports> FrameJob::run(const DepthFrame& frame) noexcept {
  if (const Status status = prepare(frame); !status.ok()) return status.error();
  if (const Status status = find_objects(frame); !status.ok()) return status.error();

  const std::size_t wanted = wanted_objects();
  std::uint32_t used = 0;  // components that belong to an accepted object
  std::size_t in_vain = 0;
  for (const ObjectGroup& group : s_.groups.groups()) {
    if ((group.members & used) != 0) continue;
    if (accepted_ >= wanted || in_vain >= s_.stages.params.general.max_components) break;
    group_ = &group;
    s_.groups.select(group, s_.work);
    const Status described = describe(frame, group);
    if (!described.ok() && described.error().code != Code::TooFewPoints) return described.error();
    bool accepted = false;
    if (described.ok()) {
      if (const Status status = register_models(accepted); !status.ok()) return status.error();
    }
    if (!accepted) {
      ++in_vain;
      continue;
    }
    ++accepted_;
    used |= group.members;
  }
  conclude();
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
  if (const Status status = watch_.enter(Stage::Background); !status.ok()) return status;
  double largest_m = 0.0;
  for (const ModelIndex& model : s_.models) largest_m = std::max(largest_m, model.diameter_m);
  Rng rng = rng_.split(1);
  s_.background = s_.stages.background.apply(s_.work, context_.background, largest_m, rng);
  // The median only where something stands above the background, and about it.
  if (const Status status = watch_.enter(Stage::Median); !status.ok()) return status;
  s_.foreground.cover_labels(s_.work);
  s_.stages.median.apply(s_.work, s_.foreground);
  s_.stages.background.apply_again(s_.work, context_.background, s_.foreground, s_.background);
  return {};
}

Status FrameJob::find_objects(const DepthFrame&) noexcept {
  if (const Status status = watch_.enter(Stage::Segment); !status.ok()) return status;
  s_.stages.segment.apply(s_.work, s_.components);
  double diameter_m = 0.0;
  double least_m2 = 1e9;
  double most_m2 = 0.0;
  const GeneralParams& general = s_.stages.params.general;
  for (const ModelIndex& model : s_.models) {
    diameter_m = std::max(diameter_m, model.diameter_m);
    least_m2 = std::min(least_m2, static_cast<double>(model.templates.least_area_m2()));
    most_m2 = std::max(most_m2, static_cast<double>(model.templates.most_area_m2()));
  }
  const double limit_m2 =
      general.max_visible_ratio > 0.0 && most_m2 > 0.0 ? general.max_visible_ratio * most_m2 : 1e9;
  s_.groups.find(s_.work, s_.components,
                 {diameter_m, general.min_visible_ratio * least_m2, limit_m2});
  most_area_m2_ = most_m2;
  things_ = 0;
  for (std::size_t i = 0; i < s_.components.size(); ++i) {
    const bool thing = s_.components[i].area_m2 >= general.min_visible_ratio * least_m2;
    things_ |= (thing ? 1U : 0U) << i;
  }
  if (!s_.groups.groups().empty() || !s_.groups.oversized().empty()) return {};
  return Error{Code::RoiEmpty, Stage::Segment, static_cast<std::int32_t>(s_.background.foreground)};
}

Status FrameJob::describe(const DepthFrame& frame, const ObjectGroup& group) noexcept {
  if (const Status status = watch_.enter(Stage::Decimate); !status.ok()) return status;
  const Result<int> stride = decimate(s_.work, group.label, frame.color, s_.stages.params.decimate,
                                      s_.spacing_m, s_.object.surface);
  if (!stride.ok()) return stride.error();
  Surface& surface = s_.object.surface;

  if (const Status status = watch_.enter(Stage::Normals); !status.ok()) return status;
  if (const Status status = s_.stages.normals->estimate(surface); !status.ok()) return status;
  // Radii given in spacings must mean the same on the model and here.
  surface.spacing_m = s_.spacing_m;
  s_.object.samples.draw(surface, rng_.split(2));
  middle_ = centroid(surface);
  ground_ = {};
  if (s_.background.plane_count > 0) {
    ground_ = {s_.background.planes[0].normal, s_.background.planes[0].offset_m};
  }
  size_ = {};
  if (s_.stages.params.general.measure_size) {
    size_ = s_.sizes.estimate(surface, ground_, rng_.split(3));
  }

  if (const Status status = watch_.enter(Stage::Keypoints); !status.ok()) return status;
  const bool by_features = s_.stages.coarse->needs_correspondences();
  DescribedSurface& object = s_.object;
  if (!by_features || !s_.stages.keypoints->detect(surface, object.keypoints).ok()) {
    object.keypoints.clear();
  }
  if (const Status status = watch_.enter(Stage::Descriptors); !status.ok()) return status;
  if (!by_features ||
      !s_.stages.descriptors->describe(surface, object.keypoints.span(), object.features).ok()) {
    object.features.rows = 0;
  }

  view_component(group.whole, group.label);
  s_.edges.build(view_);
  return {};
}

void FrameJob::view_component(const Component& component, std::uint8_t label) noexcept {
  view_ = {};
  view_.intrinsics = s_.work.intrinsics;
  view_.depth = s_.work.depth;
  view_.metres_per_unit = static_cast<float>(s_.work.metres_per_unit);
  view_.label = s_.work.label;
  view_.object = label;
  view_.things = things_;
  if (s_.background.plane_count > 0) view_.belt = &s_.background.planes[0];
  view_.noise.sigma_per_m2 = static_cast<float>(s_.stages.params.general.sigma_1m_m);
  view_.working = &s_.object.surface;
  const double pixels_per_m = view_.intrinsics.fx / component.mean_depth_m;
  const int margin_px = static_cast<int>(kBoxMargin * smallest_diameter_m_ * pixels_per_m) + 1;
  view_.box = {std::max(0, component.left - margin_px), std::max(0, component.top - margin_px),
               std::min(view_.depth.width, component.right + margin_px),
               std::min(view_.depth.height, component.bottom + margin_px)};
  const int stride =
      std::clamp(static_cast<int>(kViewPitch * smallest_diameter_m_ * pixels_per_m), 1, 8);
  s_.thinned.thin(view_, stride);
}

MeasuredObject FrameJob::measured() noexcept {
  MeasuredObject object;
  object.surface = &s_.object.surface;
  object.samples = &s_.object.samples;
  object.keypoints = &s_.object.keypoints;
  object.features = &s_.object.features;
  object.view = &view_;
  object.edges = &s_.edges;
  object.ground = ground_.known() ? &ground_ : nullptr;
  object.middle = middle_;
  object.shared_px = s_.stages.params.general.shared_error_px / (view_.stride * view_.stride);
  return object;
}

Status FrameJob::register_models(bool& accepted) noexcept {
  RegistrationReport best;
  bool reported = false;
  double rival = 0.0;  // quality of the second-best part that passes
  for (std::size_t i = 0; i < s_.models.size(); ++i) {
    if (i < 32 && (context_.model_mask >> i & 1U) == 0) continue;
    RegistrationReport report;
    if (const Status status = register_model(i, report); !status.ok()) return status;
    const bool better = !reported || (report.accepted && !best.accepted) ||
                        (report.accepted == best.accepted && report.quality > best.quality);
    const RegistrationReport& other = better ? best : report;
    if (reported && other.accepted) rival = std::max(rival, other.quality);
    if (better) best = report;
    reported = true;
  }
  // Where two parts pass on one piece it is not known which of them lies there.
  const double min_margin = s_.stages.params.verdict.min_margin;
  if (rival > (1.0 - min_margin) * best.quality) {
    best.margin = std::max(0.0, 1.0 - rival / best.quality);
    reject_for({Check::Margin, best.margin, min_margin}, best);
  }
  accepted = reported && best.accepted;
  if (!reported) return {};
  if (!accepted && s_.stages.params.surface_grasp.enabled) look_for_grasp(best);
  objects_.keep(best);
  return {};
}

Status FrameJob::register_model(std::size_t model_i, RegistrationReport& report) noexcept {
  ModelIndex& model = s_.models[model_i];
  const MeasuredObject object = measured();
  report.model = static_cast<std::uint32_t>(model_i);
  report.pieces = group_->members;
  report.symmetric = model.symmetry != Symmetry::None;
  report.size = size_;
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
  s_.search.refine_best(model, object, floor_m);
  if (const Status status = watch_.enter(Stage::Judge); !status.ok()) return status;
  const VerdictParams& verdict = s_.stages.params.verdict;
  s_.search.tell_apart(model, object, floor_m, least_accepted_worth(verdict), verdict.min_margin);
  judge(model_i, floor_m, report);
  report.budget_reached = s_.object.keypoints.overflowed() || s_.correspondences.overflowed() ||
                          model.keypoints.overflowed() || s_.components.overflowed();
  return {};
}

std::size_t FrameJob::wanted_objects() const noexcept {
  const std::size_t wanted =
      context_.max_objects > 0 ? context_.max_objects : s_.preset.max_objects;
  return std::clamp<std::size_t>(wanted, 1, 8);
}

void FrameJob::conclude() noexcept {
  const double limit = s_.stages.params.general.max_visible_ratio;
  for (const ObjectGroup& piece : s_.groups.oversized()) {
    objects_.keep_oversized(piece, piece.whole.area_m2 / most_area_m2_, limit);
  }
  objects_.reject_shared_space(s_.models, view_.noise);
  objects_.finish(s_.groups, wanted_objects());
}

}  // namespace grapnel
