#include "firmware_app/preset_source.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/registrar.h"

namespace grapnel {
namespace {

/// The registrar as jobs see it.
class RegistrarRunner final : public JobRunner {
 public:
  explicit RegistrarRunner(std::unique_ptr<Registrar> registrar)
      : registrar_(std::move(registrar)) {}
  Result<RegistrationReports> run(const DepthFrame& frame,
                                  const JobContext& context) noexcept override {
    return registrar_->run(frame, context);
  }
  Result<double> occupied_share(const DepthFrame& frame,
                                const JobContext& context) noexcept override {
    return registrar_->occupied_share(frame, context);
  }

 private:
  std::unique_ptr<Registrar> registrar_;
};

std::size_t required_bytes_of(const Preset& preset) {
  try {
    return Registrar::required_bytes(preset);
  } catch (const InputError& problem) {
    throw ConfigProblem(Code::PresetInvalid, problem.what());
  }
}

void check_budget(const Preset& preset, std::size_t needed, std::size_t budget) {
  if (needed <= budget) return;
  throw ConfigProblem(Code::OverMemoryBudget,
                      preset.file.string() + ": needs " + std::to_string(needed) +
                          " bytes, the budget of one preset is " + std::to_string(budget) +
                          " (half of memory.budget_mb)");
}

void check_model_ids(const Preset& preset, const JobProfile& profile) {
  const auto& ids = profile.preset.model_ids;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (std::count(ids.begin(), ids.end(), ids[i]) == 1) continue;
    throw ConfigProblem(Code::PresetInvalid, preset.file.string() + ": models: two have the id " +
                                                 std::to_string(ids[i]) +
                                                 "; one model each is allowed");
  }
}

/// How far the robot's pick frame stands off the taught grasp.
Pose grasp_from_pick_of(const Preset& preset) {
  Pose pose = Pose::Identity();
  const std::vector<double>& offset_m = preset.pick_offset_m;
  if (!offset_m.empty()) pose.translation() = Vec3d(offset_m[0], offset_m[1], offset_m[2]);
  if (preset.flip_z) pose.linear() = Vec3d(1.0, -1.0, -1.0).asDiagonal();
  return pose;
}

PresetOrigin origin_of(const Preset& preset, const Settings& settings) {
  PresetOrigin origin;
  origin.file = preset.file.filename().string();
  origin.text = preset.text;
  origin.config = settings.text;
  origin.overrides = settings.roi.overrides;
  origin.models_folder = settings.models_folder().string();
  for (const Model& model : preset.models) origin.models.push_back({model.name, model.hash});
  return origin;
}

}  // namespace

Preset read_preset(const Settings& settings, std::uint16_t number) {
  std::filesystem::path file;
  try {
    file = find_preset(settings.presets_folder(), number);
  } catch (const InputError& problem) {
    const bool twice = std::string(problem.what()).find(" is there twice") != std::string::npos;
    throw ConfigProblem(twice ? Code::PresetInvalid : Code::PresetMissing, problem.what());
  }
  try {
    Preset preset = load_preset(file, settings.models_folder(), settings.roi.overrides);
    if (preset.models.size() > kMaxModels) {
      throw InputError(file.string() + ": " + std::to_string(preset.models.size()) +
                       " models; at most " + std::to_string(kMaxModels) + " are allowed");
    }
    return preset;
  } catch (const InputError& problem) {
    // An override has no line of its own in the preset; it stands in grapnel.toml.
    const std::string text = problem.what();
    const std::string nowhere = "command line: ";
    const bool from_override = text.starts_with(nowhere);
    throw ConfigProblem(Code::PresetInvalid,
                        from_override ? settings.roi.place + text.substr(nowhere.size()) : text);
  }
}

JobProfile profile_of(const Preset& preset, const Settings& settings) {
  JobProfile profile;
  profile.preset.number = preset.number;
  profile.preset.rev = preset.fingerprint;
  profile.preset.timeout_ms = preset.timeout_ms;
  profile.pose_format = preset.pose_format;
  profile.retries = preset.retries;
  profile.max_occupied_share = settings.roi.max_occupied_share;
  profile.calibrated = settings.calibrated();
  profile.robot_from_camera = settings.robot_from_camera();
  for (const Model& model : preset.models) {
    ModelProfile row;
    // A model without a number of its own goes by its place in the preset.
    row.id = model.id != 0 ? model.id : static_cast<std::uint16_t>(profile.models.size() + 1);
    row.grasp_from_pick = grasp_from_pick_of(preset);
    if (!model.grasps.empty()) {
      row.grasp_id = model.grasps.front().id;
      row.model_from_grasp = model.grasps.front().model_from_grasp;
    }
    profile.models.push_back(row);
    profile.preset.model_ids.push_back(row.id);
  }
  return profile;
}

std::unique_ptr<ActivePreset> FilePresetSource::load(const Settings& settings, std::uint16_t number,
                                                     std::span<std::byte> memory) {
  Preset preset = read_preset(settings, number);
  if (preset.models.empty()) {
    throw ConfigProblem(Code::PresetInvalid,
                        preset.file.string() + ": no model; the daemon needs at least one");
  }
  check_budget(preset, required_bytes_of(preset), memory.size());
  auto active = std::make_unique<ActivePreset>();
  active->profile = profile_of(preset, settings);
  active->origin = remember(origin_of(preset, settings));
  check_model_ids(preset, active->profile);
  try {
    active->runner =
        std::make_unique<RegistrarRunner>(Registrar::create(std::move(preset), memory));
  } catch (const InputError& problem) {
    throw ConfigProblem(Code::PresetInvalid, problem.what());
  }
  return active;
}

std::uint32_t FilePresetSource::remember(PresetOrigin origin) {
  const std::lock_guard lock(mutex_);
  origins_.emplace(++loads_, std::move(origin));
  if (origins_.size() > kOrigins) origins_.erase(origins_.begin());
  return loads_;
}

std::optional<PresetOrigin> FilePresetSource::origin(std::uint32_t number) const {
  const std::lock_guard lock(mutex_);
  const auto found = origins_.find(number);
  if (found == origins_.end()) return std::nullopt;
  return found->second;
}

void FilePresetSource::check(const Settings& settings, std::uint16_t number, std::size_t bytes) {
  const Preset preset = read_preset(settings, number);
  check_budget(preset, required_bytes_of(preset), bytes);
}

}  // namespace grapnel
