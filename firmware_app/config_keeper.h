#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware_app/job.h"
#include "firmware_app/preset_source.h"
#include "firmware_app/preset_switch.h"
#include "firmware_app/settings.h"

namespace grapnel {

/// Keeps the configuration: loads it, switches it, falls back. A new preset is built beside the old
/// one in the other half of the block and taken over between two jobs; whatever fails leaves the
/// old one running. Runs on the config thread.
class ConfigKeeper {
 public:
  /// Told in one line what happened: good news or a refusal.
  using Reporter = std::function<void(bool refused, Code code, const std::string& line)>;

  struct Parts {
    Exchange* exchange = nullptr;
    PresetSource* source = nullptr;
    PresetSwitch* presets = nullptr;
    Reporter report;
  };
  struct Start {
    std::filesystem::path file;          ///< grapnel.toml
    std::vector<std::string> overrides;  ///< of the command line
  };
  /// Jobs that must have run on a configuration before it counts as good.
  static constexpr std::uint32_t kProvisionalJobs = 3;

  /// `block` holds two presets.
  ConfigKeeper(Parts parts, Start start, std::span<std::byte> block);

  /// The settings to start with: the file's, or, when it is refused and a last good configuration
  /// is kept, that one's. Throws ConfigProblem.
  [[nodiscard]] static Settings settings_at_start(const Start& start);

  /// First load, before any thread runs: grapnel.toml's preset. When the file is refused and a last
  /// good configuration is kept in `state_folder`, that one, and the device is REDUCED. Throws
  /// ConfigProblem.
  void start(const std::filesystem::path& state_folder);

  /// One round: a wish of the PLC, a changed file (`file_changed`), a switch in progress. Never
  /// waits.
  void step(bool file_changed);
  /// True while a new preset waits for the end of a job.
  [[nodiscard]] bool switching() const noexcept { return next_ != nullptr; }

  [[nodiscard]] const Settings& settings() const noexcept { return settings_; }

 private:
  struct Loaded {
    Settings settings;
    std::uint16_t choice = 0;  ///< preset the PLC selected; 0: the file's
    std::unique_ptr<ActivePreset> preset;
  };

  [[nodiscard]] Loaded load_file();
  /// `choice` 0: the preset that the text names.
  [[nodiscard]] Loaded load_text(const std::string& text, std::uint16_t choice);
  [[nodiscard]] std::unique_ptr<ActivePreset> build(const Settings& settings, std::uint16_t number);
  void begin_switch(Loaded loaded, Code state, bool reduced);
  void finish_switch();
  void work_off(const ConfigRequest& request);
  void refuse(const ConfigProblem& problem, bool from_file);
  void answer(Code code, std::uint16_t detail = 0);
  void commit_when_proven();
  void publish();
  [[nodiscard]] std::span<std::byte> free_half() const;

  Parts parts_;
  Start start_;
  std::span<std::byte> block_;
  Settings settings_;
  std::uint16_t choice_ = 0;  // preset the PLC selected; 0: the file's
  std::string good_text_;     // of the last one that proved itself
  std::filesystem::path good_file_;
  std::uint32_t jobs_at_load_ = 0;
  bool committed_ = false;

  std::unique_ptr<ActivePreset> current_;
  std::unique_ptr<ActivePreset> next_;
  std::optional<Loaded> incoming_;
  Code incoming_state_ = Code::ConfigLoaded;
  bool incoming_reduced_ = false;
  bool owes_answer_ = false;  // to the wish that started the switch
  ConfigRequest wish_;
  ConfigState state_;
};

}  // namespace grapnel
