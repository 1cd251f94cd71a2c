#include "workbench/job.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "base/input_error.h"
#include "workbench/presets.h"
#include "workbench/surfaces.h"

namespace grapnel {
namespace {

void raise_limits(Limits& limits, const Input& input) {
  if (input.is_frame()) {
    limits.max_width = std::max(limits.max_width, input.frame().depth.width);
    limits.max_height = std::max(limits.max_height, input.frame().depth.height);
    limits.max_input_points = std::max(limits.max_input_points, input.frame().depth.pixels());
    return;
  }
  const CloudData& cloud = input.cloud();
  limits.max_input_points = std::max(limits.max_input_points, cloud.size());
  if (!cloud.organized()) return;
  limits.max_width = std::max(limits.max_width, cloud.width);
  limits.max_height = std::max(limits.max_height, cloud.height);
}

CloudData model_cloud(const Model& model) {
  CloudData cloud;
  cloud.x = model.x;
  cloud.y = model.y;
  cloud.z = model.z;
  cloud.width = static_cast<int>(model.size());
  return cloud;
}

}  // namespace

Job::Job(const JobInputs& inputs, const std::string& preset,
         const std::vector<std::string>& overrides)
    : kind_(inputs.kind), target_(load_input(inputs.target, inputs.target_options)) {
  const std::filesystem::path file = preset_file(preset);
  Preset loaded = load_preset(file, models_folder(file), overrides);
  raise_limits(loaded.limits, target_);
  if (kind_ == JobKind::Object) {
    if (!is_cloud_name(inputs.source)) {
      throw InputError(inputs.source + ": a model is a .ply or .pcd file");
    }
    model_ = load_model(inputs.source);
    if (inputs.symmetry) model_->symmetry = *inputs.symmetry;
    symmetry_ = model_->symmetry;
    loaded.models = {*model_};
  } else {
    source_ = load_input(inputs.source, inputs.source_options);
    raise_limits(loaded.limits, *source_);
    symmetry_ = inputs.symmetry.value_or(Symmetry::None);
    loaded.models.clear();
  }
  registrar_ = Registrar::create(std::move(loaded));
  context_.clock = &clock_;
  context_.has_initial = inputs.initial.has_value();
  if (inputs.initial) context_.initial = *inputs.initial;
}

Job::~Job() = default;

Answer Job::run() {
  const std::int64_t begin_us = clock_.now_us();
  const auto answer_of = [&](const Result<RegistrationReports>& result) {
    Answer answer =
        result ? answer_from_reports(result.value()) : answer_from_error(result.error());
    answer.total_ms = static_cast<double>(clock_.now_us() - begin_us) / 1000.0;
    answer.peak_bytes = registrar_->used_bytes();
    if (model_) answer.model = model_->name;
    return answer;
  };
  if (kind_ == JobKind::Object && target_.is_frame()) {
    return answer_of(registrar_->run(target_.frame(), context_));
  }
  const std::unique_ptr<StoredSurface> target = make_surface(target_);
  if (kind_ == JobKind::Object) return answer_of(registrar_->run(target->surface, context_));
  const std::unique_ptr<StoredSurface> source = make_surface(*source_);
  return answer_of(registrar_->register_pair(source->surface, target->surface, context_));
}

std::vector<Vec3f> Job::source_points() const {
  if (!model_) return points_of(*source_);
  std::vector<Vec3f> points;
  points.reserve(model_->size());
  for (std::size_t i = 0; i < model_->size(); ++i) {
    points.emplace_back(model_->x[i], model_->y[i], model_->z[i]);
  }
  return points;
}

CloudData Job::source_cloud() const { return model_ ? model_cloud(*model_) : cloud_of(*source_); }

CloudData Job::target_cloud() const { return cloud_of(target_); }

bool has_model_file(const std::string& source) {
  std::error_code ignored;
  return is_cloud_name(source) &&
         std::filesystem::is_regular_file(std::filesystem::path(source).replace_extension(".toml"),
                                          ignored);
}

}  // namespace grapnel
