#include "pipeline/registrar_state.h"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <new>
#include <utility>

#include "base/input_error.h"
#include "base/running_stage.h"

namespace grapnel {

JobWatch::JobWatch(const JobContext& context, RegistrationReports& reports) noexcept
    : context_(context), reports_(reports) {
  if (context_.clock != nullptr) begin_us_ = since_us_ = context_.clock->now_us();
}

void JobWatch::charge() noexcept {
  const std::int64_t now_us = context_.clock->now_us();
  reports_.stage_us[static_cast<std::size_t>(stage_)] +=
      static_cast<std::uint32_t>(now_us - since_us_);
  since_us_ = now_us;
}

Status JobWatch::enter(Stage stage) noexcept {
  if (context_.clock != nullptr) {
    charge();
    if (context_.deadline_us > 0 && since_us_ >= context_.deadline_us) {
      return Error{Code::JobDeadline, stage_, static_cast<std::int32_t>(stage)};
    }
  }
  stage_ = stage;
  note_stage(stage);
  if (context_.abort != nullptr && context_.abort->load(std::memory_order_relaxed)) {
    return Error{Code::Aborted, stage, 0};
  }
  return {};
}

void JobWatch::finish() noexcept {
  if (context_.clock == nullptr) return;
  charge();
  reports_.total_us = static_cast<std::uint32_t>(since_us_ - begin_us_);
}

void DescribedSurface::reserve(Arena& arena, const Limits& limits, std::size_t grid_pixels,
                               std::size_t dimension, std::size_t max_samples) {
  surface.reserve(arena, limits.max_points, grid_pixels);
  samples.reserve(arena, max_samples);
  keypoints = KeypointSet(arena.take<Keypoint>(limits.max_keypoints));
  features.reserve(arena, limits.max_keypoints, dimension);
}

void RegistrarState::FreeBlock::operator()(std::byte* block) const noexcept {
  ::operator delete[](block, std::align_val_t{Arena::kAlignment});
}

RegistrarState::RegistrarState(Preset preset_)
    : preset(std::move(preset_)),
      stages(preset.source),
      search(stages.params.search, *stages.coarse, *stages.refine_coarse, *stages.refine,
             stages.params.contour) {
  models.resize(preset.models.size());
  double smallest_m = std::numeric_limits<double>::max();
  for (const Model& model : preset.models) {
    smallest_m = std::min(smallest_m, model.diameter_m);
    const Grasp& first = model.grasps.front();
    required.push_back(required_directions(first.required, model.symmetry));
    grasp.push_back(first.model_from_grasp);
  }
  const GeneralParams& general = stages.params.general;
  if (general.spacing_m > 0.0) {
    spacing_m = general.spacing_m;
  } else if (!preset.models.empty()) {
    spacing_m = general.spacing_ratio * smallest_m;
  }
}

void RegistrarState::reserve(Arena& arena, std::vector<MemoryItem>* parts) {
  Limits limits = preset.limits;
  const auto pixels =
      static_cast<std::size_t>(limits.max_width) * static_cast<std::size_t>(limits.max_height);
  const std::size_t dimension = stages.descriptors->dimension();
  limits.descriptor_dimension = dimension;
  std::size_t before = arena.used_bytes();
  const auto part = [&](const char* name) {
    if (parts != nullptr) parts->push_back({name, arena.used_bytes() - before});
    before = arena.used_bytes();
  };
  work.reserve(arena, limits);
  depth_of_cloud = arena.take<std::uint16_t>(pixels);
  part("frame");
  stages.outliers.reserve(arena, limits);
  stages.median.reserve(arena, limits);
  foreground.reserve(arena, limits);
  stages.background.reserve(arena, limits);
  stages.segment.reserve(arena, limits);
  groups.reserve(arena, limits);
  part("preprocessing");
  stages.normals->reserve(arena, limits);
  const bool by_features = stages.coarse->needs_correspondences();
  if (by_features) {
    stages.keypoints->reserve(arena, limits);
    stages.descriptors->reserve(arena, limits);
  } else {
    limits.max_keypoints = 0;
  }
  part("features");
  object.reserve(arena, limits, pixels, dimension, stages.params.model.samples);
  part("measured object");
  stages.match->reserve(arena, limits);
  stages.reject->reserve(arena, limits);
  correspondences = Correspondences(arena.take<Correspondence>(limits.max_correspondences));
  part("correspondences");
  thinned.reserve(arena, pixels);
  edges.reserve(arena, pixels);
  stages.coarse->reserve(arena, limits);
  stages.refine_coarse->reserve(arena, limits);
  stages.refine->reserve(arena, limits);
  if (stages.params.general.measure_size) sizes.reserve(arena, limits.max_points);
  search.reserve(arena, limits, stages.params.model.surface_points);
  part("search and judge");
  const std::size_t scratch =
      std::max({limits.max_points, limits.max_model_points, stages.params.model.surface_points});
  for (std::span<float>* plane : {&own_nx, &own_ny, &own_nz}) *plane = arena.take<float>(scratch);
  if (models.empty()) {
    pair.voxel.reserve(arena, limits);
    pair.grid.reserve(arena, limits);
    pair.work.reserve(arena, limits.max_input_points, 0);
    for (ViewIndex* view : {&pair.source, &pair.target}) {
      view->reserve(arena, limits, dimension, stages.params.model.surface_points,
                    stages.params.model.table_voxels, stages.params.model.samples);
    }
    pair.proposed = Hypotheses(arena.take<Hypothesis>(stages.params.search.kept));
    pair.settled = Hypotheses(arena.take<Hypothesis>(stages.params.search.finalists));
    pair.candidates =
        FixedList<PairCandidate>(arena.take<PairCandidate>(stages.params.search.finalists));
    part("pair");
  }
  for (std::size_t i = 0; i < models.size(); ++i) {
    models[i].reserve(arena, preset.models[i], stages.params.model, limits, dimension);
    part(("model " + preset.models[i].name).c_str());
  }
}

Status RegistrarState::renew_normals(Surface& surface, bool keep_side) noexcept {
  const std::size_t count = keep_side ? surface.size : 0;
  GRAPNEL_ASSERT(count <= own_nx.size());
  std::copy_n(surface.nx.begin(), count, own_nx.begin());
  std::copy_n(surface.ny.begin(), count, own_ny.begin());
  std::copy_n(surface.nz.begin(), count, own_nz.begin());
  if (const Status status = stages.normals->estimate(surface); !status.ok()) return status;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3f own(own_nx[i], own_ny[i], own_nz[i]);
    if (!surface.has_normal(i)) {
      surface.nx[i] = own.x();
      surface.ny[i] = own.y();
      surface.nz[i] = own.z();
    } else if (surface.normal(i).dot(own) < 0.0F) {
      surface.nx[i] = -surface.nx[i];
      surface.ny[i] = -surface.ny[i];
      surface.nz[i] = -surface.nz[i];
    }
  }
  return {};
}

void RegistrarState::build_models() {
  for (std::size_t i = 0; i < models.size(); ++i) {
    ModelIndex& model = models[i];
    model.build(preset.models[i], stages.params.model, spacing_m);
    // Thinning averaged them; a model too sparse for new ones keeps those.
    (void)renew_normals(model.coarse, true);
    if (!stages.coarse->needs_correspondences()) continue;
    // A model without features is still found by its views.
    if (!stages.keypoints->detect(model.coarse, model.keypoints).ok()) model.keypoints.clear();
    if (!stages.descriptors->describe(model.coarse, model.keypoints.span(), model.features).ok()) {
      model.features.rows = 0;
    }
  }
}

}  // namespace grapnel
