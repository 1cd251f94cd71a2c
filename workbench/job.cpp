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

/// What inputs need of a preset's limits.
struct Extent {
  int width = 0;
  int height = 0;
  std::size_t points = 0;

  void include(const Input& input) {
    if (input.is_frame()) {
      include_grid(input.frame().depth.width, input.frame().depth.height);
      points = std::max(points, input.frame().depth.pixels());
      return;
    }
    const CloudData& cloud = input.cloud();
    points = std::max(points, cloud.size());
    if (cloud.organized()) include_grid(cloud.width, cloud.height);
  }
  void include_grid(int w, int h) {
    width = std::max(width, w);
    height = std::max(height, h);
  }
  void raise(Limits& limits) const {
    limits.max_width = std::max(limits.max_width, width);
    limits.max_height = std::max(limits.max_height, height);
    limits.max_input_points = std::max(limits.max_input_points, points);
  }
};

/// Whatever a registrar depends on, in one text.
std::string key_of(const JobInputs& inputs, const std::string& preset,
                   const std::vector<std::string>& overrides, const Extent& extent) {
  std::string key = preset + '\n';
  for (const std::string& assignment : overrides) key += assignment + '\n';
  if (inputs.kind == RegistrationKind::Object) {
    key += inputs.source + '\n' + (inputs.symmetry ? symmetry_name(*inputs.symmetry) : "") + '\n';
  }
  return key + std::to_string(extent.width) + ' ' + std::to_string(extent.height) + ' ' +
         std::to_string(extent.points);
}

PreparedRegistrar prepare(const JobInputs& inputs, const std::string& preset,
                          const std::vector<std::string>& overrides, const Extent& extent) {
  const std::filesystem::path file = preset_file(preset);
  Preset loaded = load_preset(file, models_folder(file), overrides);
  extent.raise(loaded.limits);
  PreparedRegistrar prepared;
  loaded.models.clear();
  if (inputs.kind == RegistrationKind::Object) {
    if (!is_cloud_name(inputs.source)) {
      throw InputError(inputs.source + ": a model is a .ply or .pcd file");
    }
    prepared.model = load_model(inputs.source);
    if (inputs.symmetry) prepared.model->symmetry = *inputs.symmetry;
    loaded.models = {*prepared.model};
  }
  prepared.registrar = Registrar::create(std::move(loaded));
  return prepared;
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
         const std::vector<std::string>& overrides, RegistrarStore* store)
    : kind_(inputs.kind), target_(load_input(inputs.target, inputs.target_options)) {
  Extent extent;
  extent.include(target_);
  if (kind_ == RegistrationKind::Pair) {
    source_ = load_input(inputs.source, inputs.source_options);
    extent.include(*source_);
  }
  prepared_ = &(store != nullptr ? *store : own_)
                   .find_or_make(key_of(inputs, preset, overrides, extent),
                                 [&] { return prepare(inputs, preset, overrides, extent); });
  symmetry_ =
      prepared_->model ? prepared_->model->symmetry : inputs.symmetry.value_or(Symmetry::None);
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
    answer.peak_bytes = prepared_->registrar->used_bytes();
    if (model()) answer.model = model()->name;
    return answer;
  };
  if (kind_ == RegistrationKind::Object && target_.is_frame()) {
    return answer_of(prepared_->registrar->run(target_.frame(), context_));
  }
  const std::unique_ptr<StoredSurface> target = make_surface(target_);
  if (kind_ == RegistrationKind::Object)
    return answer_of(prepared_->registrar->run(target->surface, context_));
  const std::unique_ptr<StoredSurface> source = make_surface(*source_);
  return answer_of(prepared_->registrar->register_pair(source->surface, target->surface, context_));
}

std::vector<Vec3f> Job::source_points() const {
  if (!model()) return points_of(*source_);
  std::vector<Vec3f> points;
  points.reserve(model()->size());
  for (std::size_t i = 0; i < model()->size(); ++i) {
    points.emplace_back(model()->x[i], model()->y[i], model()->z[i]);
  }
  return points;
}

CloudData Job::source_cloud() const { return model() ? model_cloud(*model()) : cloud_of(*source_); }

CloudData Job::target_cloud() const { return cloud_of(target_); }

bool has_model_file(const std::string& source) {
  std::error_code ignored;
  return is_cloud_name(source) &&
         std::filesystem::is_regular_file(std::filesystem::path(source).replace_extension(".toml"),
                                          ignored);
}

}  // namespace grapnel
