#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "firmware_app/config_problem.h"
#include "firmware_app/job_runner.h"
#include "firmware_app/settings.h"
#include "pipeline/preset.h"

namespace grapnel {

/// Where presets come from: files and the registrar in the daemon, a fake in tests. Calls are made
/// on the config thread.
class PresetSource {
 public:
  virtual ~PresetSource() = default;
  /// Reads preset `number`, checks it against the budget and builds it in `memory`. Throws
  /// ConfigProblem (PresetMissing, PresetInvalid, FileUnreadable, OverMemoryBudget).
  virtual std::unique_ptr<ActivePreset> load(const Settings& settings, std::uint16_t number,
                                             std::span<std::byte> memory) = 0;
  /// The same without building anything.
  virtual void check(const Settings& settings, std::uint16_t number, std::size_t bytes) = 0;
};

/// Presets of config/presets, run by the registrar.
class FilePresetSource final : public PresetSource {
 public:
  std::unique_ptr<ActivePreset> load(const Settings& settings, std::uint16_t number,
                                     std::span<std::byte> memory) override;
  void check(const Settings& settings, std::uint16_t number, std::size_t bytes) override;
};

/// Reads a preset with the place's own overrides. Throws ConfigProblem.
[[nodiscard]] Preset read_preset(const Settings& settings, std::uint16_t number);

/// What of a preset and the place's calibration a job needs.
[[nodiscard]] JobProfile profile_of(const Preset& preset, const Settings& settings);

}  // namespace grapnel
