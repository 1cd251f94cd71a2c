#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>

#include "firmware_app/config_problem.h"
#include "firmware_app/job_runner.h"
#include "firmware_app/settings.h"
#include "firmware_app/snapshot.h"
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

  /// Any thread: where the preset with ActivePreset::origin `number` came from; nothing when many
  /// were loaded since.
  [[nodiscard]] std::optional<PresetOrigin> origin(std::uint32_t number) const;

 private:
  static constexpr std::size_t kOrigins = 8;

  std::uint32_t remember(PresetOrigin origin);

  mutable std::mutex mutex_;
  std::map<std::uint32_t, PresetOrigin> origins_;  // the last kOrigins
  std::uint32_t loads_ = 0;
};

/// Reads a preset with the place's own overrides. Throws ConfigProblem.
[[nodiscard]] Preset read_preset(const Settings& settings, std::uint16_t number);

/// What of a preset and the place's calibration a job needs.
[[nodiscard]] JobProfile profile_of(const Preset& preset, const Settings& settings);

}  // namespace grapnel
