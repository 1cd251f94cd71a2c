#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/config.h"
#include "base/field.h"
#include "base/geometry.h"
#include "drivers/modbus/modbus_config.h"
#include "drivers/replay/frame_recorder.h"

namespace grapnel {

/// Which frame answers a trigger.
enum class FrameChoice : std::uint8_t {
  FirstAfter,  ///< the first whose exposure starts after the command was accepted
  Nearest,     ///< the one nearest in time
};

/// Keys at the top of grapnel.toml.
struct GeneralSettings {
  int active_preset = 0;
  bool auto_arm = false;
};

/// [presets]: where presets and models lie.
struct PresetSettings {
  std::string folder = "presets";
  std::string models = "models";
};

/// [capture]: how frames are held, chosen and judged before the pipeline sees them.
struct CaptureSettings {
  FrameChoice frame_choice = FrameChoice::FirstAfter;
  int pool_frames = 8;
  int max_width = 640;
  int max_height = 480;
  bool color = true;
  int exposure_us = 33000;
  int frame_wait_ms = 400;
  double min_valid_share = 0.02;
  int max_lost_packets = 50;
  bool need_color = false;
  double min_rate_hz = 5.0;
  double max_tilt_rad = 0.035;  ///< two degrees: a few centimetres at arm's length
  double max_belt_shift_m = 0.02;
  int warm_up_s = 0;
  std::vector<double> gravity;  ///< as the sensor feels it in its right place; empty: as at start
};

/// [belt]: the taught background.
struct BeltSettings {
  int learn_frames = 9;
  std::vector<double> plane;  ///< nx ny nz offset_m in the camera frame; empty: learned, or none
};

/// [roi]: the region of interest as keys of the preset, for every preset alike.
struct RoiSettings {
  double max_occupied_share = 0.002;
  std::vector<std::string> overrides;  ///< "key=value"
  std::string place;                   ///< file and line of `overrides`, for messages
};

/// [calibration]: camera to robot.
struct CalibrationSettings {
  std::string serial;
  std::vector<double> robot_from_camera_rows;  ///< 16 numbers, row-major; empty: not calibrated
};

/// [realtime]: what is asked of the kernel.
struct RealtimeSettings {
  bool lock_memory = true;
  int capture_priority = 60;
  int registration_priority = 50;
  int capture_cpu = -1;
  int registration_cpu = -1;
};

/// [memory]: size of the block for two presets.
struct MemorySettings {
  int budget_mb = 512;
};

/// [state]: what the daemon keeps between runs.
struct StateSettings {
  std::string folder = "state";
};

/// [snapshots]: jobs kept with all they depended on.
struct SnapshotSettings {
  bool on_reject = true;
  int keep = 50;
};

/// [recording]: what commands 53 and 54 record.
struct RecordingSettings {
  RecordColor color = RecordColor::Png;
  int jpeg_quality = 92;
  int max_seconds = 3600;
  int min_free_mb = 1024;
  int queue_mb = 64;
};

/// grapnel.toml, taken apart and checked. Relative paths are already resolved.
struct Settings {
  std::filesystem::path file;
  std::string text;            ///< of the file
  std::filesystem::path base;  ///< folder that relative paths refer to
  GeneralSettings general;
  PresetSettings presets;
  CaptureSettings capture;
  BeltSettings belt;
  RoiSettings roi;
  CalibrationSettings calibration;
  RealtimeSettings realtime;
  MemorySettings memory;
  StateSettings state;
  SnapshotSettings snapshots;
  RecordingSettings recording;
  ConfigTable camera;  ///< [camera], for the driver registry; key `driver` is present
  ModbusConfig fieldbus;

  [[nodiscard]] std::filesystem::path presets_folder() const { return base / presets.folder; }
  [[nodiscard]] std::filesystem::path models_folder() const { return base / presets.models; }
  [[nodiscard]] std::filesystem::path state_folder() const;
  [[nodiscard]] bool calibrated() const { return !calibration.robot_from_camera_rows.empty(); }
  /// Identity when not calibrated.
  [[nodiscard]] Pose robot_from_camera() const;
  /// Bytes one preset may take: half of the budget.
  [[nodiscard]] std::size_t preset_budget_bytes() const {
    return static_cast<std::size_t>(memory.budget_mb) * (std::size_t{1} << 20) / 2;
  }
};

/// One table of grapnel.toml for the manual: its name ("" = top) and rows.
struct SettingsSection {
  std::string_view name;
  FieldTable fields;
};

/// Every section with a field table, in the order of the shipped file.
[[nodiscard]] std::vector<SettingsSection> settings_sections();

/// Takes a parsed grapnel.toml apart. Relative paths refer to `base`. Throws InputError.
[[nodiscard]] Settings read_settings(const ConfigTable& root, const std::filesystem::path& file,
                                     const std::filesystem::path& base);

/// Reads grapnel.toml; `overrides` are "table.key=value". Throws InputError.
[[nodiscard]] Settings load_settings(const std::filesystem::path& file,
                                     const std::vector<std::string>& overrides);

/// Names of the sections and keys that differ and take effect only at a restart, separated by
/// commas;
/// "" when none.
[[nodiscard]] std::string needs_restart(const Settings& running, const Settings& wanted);

}  // namespace grapnel
