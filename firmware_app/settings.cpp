#include "firmware_app/settings.h"

#include <array>
#include <cmath>
#include <cstdlib>

#include "base/input_error.h"

namespace grapnel {
namespace {

constexpr std::array<std::string_view, 2> kFrameChoices = {"first_after", "nearest"};

constexpr std::array<Field, 2> kGeneral = {
    number_field<&GeneralSettings::active_preset>(
        "active_preset", "", 1, 999, "number NN of the preset file NN-name.toml that is in use"),
    bool_field<&GeneralSettings::auto_arm>(
        "auto_arm", "armed as soon as the daemon is up; false: the PLC sends command 10"),
};
constexpr std::array<Field, 2> kPresets = {
    text_field<&PresetSettings::folder>("folder", "folder of the presets"),
    text_field<&PresetSettings::models>("models", "folder of the models"),
};
constexpr std::array<Field, 15> kCapture = {
    choice_field<&CaptureSettings::frame_choice>(
        "frame_choice", kFrameChoices,
        "frame that answers a trigger: the first exposed after it, or the nearest in time"),
    number_field<&CaptureSettings::pool_frames>("pool_frames", "", 4, 64, "frames held in memory"),
    number_field<&CaptureSettings::max_width>("max_width", "px", 16, 4096,
                                              "widest depth image the memory is planned for"),
    number_field<&CaptureSettings::max_height>("max_height", "px", 16, 4096,
                                               "highest depth image the memory is planned for"),
    bool_field<&CaptureSettings::color>("color", "keep room for colour images"),
    number_field<&CaptureSettings::exposure_us>(
        "exposure_us", "us", 0, 1000000,
        "length of an exposure; with its stamp at mid-exposure it tells when one started"),
    number_field<&CaptureSettings::frame_wait_ms>(
        "frame_wait_ms", "ms", 10, 10000, "a job waits this long for its frame, then answers 2003"),
    number_field<&CaptureSettings::min_valid_share>(
        "min_valid_share", "", 0, 1, "share of pixels with a reading below which a frame is 2006"),
    number_field<&CaptureSettings::max_lost_packets>("max_lost_packets", "", 0, 100000,
                                                     "lost packets above which a frame is 2004"),
    bool_field<&CaptureSettings::need_color>("need_color", "a frame without colour is 2007"),
    number_field<&CaptureSettings::min_rate_hz>("min_rate_hz", "Hz", 0, 240,
                                                "frames a second below which the sensor is 2003"),
    number_field<&CaptureSettings::max_tilt_rad>(
        "max_tilt_rad", "rad", 0, 3.2,
        "turn of the camera beyond which it is 2009, by its accelerometer; 0: not watched"),
    number_field<&CaptureSettings::max_belt_shift_m>(
        "max_belt_shift_m", "m", 0, 0.05,
        "belt seen further from where it was taught is 2009, or tilted by max_tilt_rad; 0: not "
        "watched"),
    number_field<&CaptureSettings::warm_up_s>(
        "warm_up_s", "s", 0, 86400, "a sensor that has just begun to stream is 2010 for so long"),
    numbers_field<&CaptureSettings::gravity>(
        "gravity", "g", -4, 4,
        "the accelerometer's x, y, z with the camera in its place; empty: as at the start, and "
        "whenever the background is learned"),
};
constexpr std::array<Field, 2> kBelt = {
    number_field<&BeltSettings::learn_frames>("learn_frames", "", 1, 15,
                                              "frames that command 60 takes the median of"),
    numbers_field<&BeltSettings::plane>(
        "plane", "", -1e3, 1e3,
        "nx, ny, nz toward the camera and offset in m, n·p + offset = 0; empty: as learned"),
};
constexpr std::array<Field, 2> kRoi = {
    number_field<&RoiSettings::max_occupied_share>(
        "max_occupied_share", "", 0, 1, "share of the region that counts as empty (command 61)"),
    texts_field<&RoiSettings::overrides>(
        "overrides", "\"key=value\" of presets that this place fixes for all of them"),
};
constexpr std::array<Field, 2> kCalibration = {
    text_field<&CalibrationSettings::serial>("serial",
                                             "camera the calibration belongs to; empty: any"),
    numbers_field<&CalibrationSettings::robot_from_camera_rows>(
        "robot_from_camera", "", -1e4, 1e4,
        "4×4 row-major, metres; empty: poses stay in the camera's frame"),
};
constexpr std::array<Field, 5> kRealtime = {
    bool_field<&RealtimeSettings::lock_memory>("lock_memory", "keep all memory resident"),
    number_field<&RealtimeSettings::capture_priority>("capture_priority", "", 0, 90,
                                                      "SCHED_FIFO; 0 = normal scheduling"),
    number_field<&RealtimeSettings::registration_priority>("registration_priority", "", 0, 90,
                                                           "SCHED_FIFO; 0 = normal scheduling"),
    number_field<&RealtimeSettings::capture_cpu>("capture_cpu", "", -1, 1023,
                                                 "processor of the capture thread; -1 = any"),
    number_field<&RealtimeSettings::registration_cpu>(
        "registration_cpu", "", -1, 1023, "processor of the registration thread; -1 = any"),
};
constexpr std::array<Field, 1> kMemory = {
    number_field<&MemorySettings::budget_mb>("budget_mb", "MiB", 1, 65536,
                                             "memory of two presets, the old and the new"),
};
constexpr std::array<Field, 1> kState = {
    text_field<&StateSettings::folder>(
        "folder", "what is kept between runs; under systemd its state directory"),
};

constexpr std::array<Field, 2> kSnapshots = {
    bool_field<&SnapshotSettings::on_reject>("on_reject",
                                             "keep a snapshot of every job that was rejected"),
    number_field<&SnapshotSettings::keep>("keep", "", 0, 100000,
                                          "snapshots kept, the oldest goes first; 0: none"),
};

constexpr std::array<std::string_view, 3> kRecordColors = {"none", "png", "jpeg"};

constexpr std::array<Field, 5> kRecording = {
    choice_field<&RecordingSettings::color>(
        "color", kRecordColors, "png is lossless; in jpeg, colour keypoints differ from the live"),
    number_field<&RecordingSettings::jpeg_quality>("jpeg_quality", "", 1, 100, "of jpeg"),
    number_field<&RecordingSettings::max_seconds>("max_seconds", "s", 0, 10000000,
                                                  "a recording ends by itself; 0: only by command"),
    number_field<&RecordingSettings::min_free_mb>(
        "min_free_mb", "MiB", 1, 100000000, "left free on the disk: below, frames are dropped"),
    number_field<&RecordingSettings::queue_mb>("queue_mb", "MiB", 1, 4096,
                                               "encoded images that may wait for a slow disk"),
};

void read_section(ConfigReader& root, std::string_view name, FieldTable fields, void* object) {
  const ConfigTable* table = root.take_table(name);
  if (table == nullptr) return;
  ConfigReader reader(*table);
  reader.take_fields(fields, object);
  reader.finish();
}

Pose pose_of_rows(const std::vector<double>& rows) {
  Pose pose = Pose::Identity();
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      pose.matrix()(row, column) = rows[static_cast<std::size_t>(4 * row + column)];
    }
  }
  return pose;
}

void read_calibration(ConfigReader& root, CalibrationSettings& calibration) {
  const ConfigTable* table = root.take_table("calibration");
  if (table == nullptr) return;
  ConfigReader reader(*table);
  reader.take_fields(kCalibration, &calibration);
  reader.finish();
  const std::vector<double>& rows = calibration.robot_from_camera_rows;
  if (rows.empty()) return;
  // Six digits in the file are enough for a rotation; more than this is no rotation.
  constexpr double kRigidTolerance = 1e-5;
  if (rows.size() != 16) {
    throw reader.problem("robot_from_camera", "a list of " + std::to_string(rows.size()) +
                                                  " numbers is not allowed; 16 are");
  }
  if (!is_rigid(pose_of_rows(rows).matrix(), kRigidTolerance)) {
    throw reader.problem("robot_from_camera",
                         "not a rigid motion; a rotation, a translation and 0 0 0 1 are allowed");
  }
}

void read_roi(ConfigReader& root, RoiSettings& roi) {
  const ConfigTable* table = root.take_table("roi");
  if (table == nullptr) return;
  ConfigReader reader(*table);
  reader.take_fields(kRoi, &roi);
  reader.finish();
  roi.place = reader.problem("overrides", "").what();
}

void read_belt(ConfigReader& root, BeltSettings& belt) {
  const ConfigTable* table = root.take_table("belt");
  if (table == nullptr) return;
  ConfigReader reader(*table);
  reader.take_fields(kBelt, &belt);
  reader.finish();
  if (belt.plane.empty()) return;
  if (belt.plane.size() != 4) {
    throw reader.problem("plane", "a list of " + std::to_string(belt.plane.size()) +
                                      " numbers is not allowed; 4 are");
  }
  const double length = std::sqrt(belt.plane[0] * belt.plane[0] + belt.plane[1] * belt.plane[1] +
                                  belt.plane[2] * belt.plane[2]);
  if (std::abs(length - 1.0) > 1e-3) {
    throw reader.problem(
        "plane", "its normal has length " + std::to_string(length) + "; 0.999 to 1.001 is allowed");
  }
}

}  // namespace

std::vector<SettingsSection> settings_sections() {
  return {{"", kGeneral},
          {"presets", kPresets},
          {"capture", kCapture},
          {"belt", kBelt},
          {"roi", kRoi},
          {"calibration", kCalibration},
          {"fieldbus", modbus_fields()},
          {"memory", kMemory},
          {"realtime", kRealtime},
          {"state", kState},
          {"snapshots", kSnapshots},
          {"recording", kRecording}};
}

std::filesystem::path Settings::state_folder() const {
  // systemd makes and owns the folder and names it here; a list is separated by colons.
  const char* given = std::getenv("STATE_DIRECTORY");
  if (given == nullptr || *given == '\0') return base / state.folder;
  const std::string folders(given);
  return folders.substr(0, folders.find(':'));
}

Pose Settings::robot_from_camera() const {
  return calibrated() ? pose_of_rows(calibration.robot_from_camera_rows) : Pose::Identity();
}

Settings read_settings(const ConfigTable& root, const std::filesystem::path& file,
                       const std::filesystem::path& base) {
  Settings settings;
  settings.file = file;
  settings.base = base;
  ConfigReader reader(root);
  reader.require("active_preset");
  reader.take_fields(kGeneral, &settings.general);
  read_section(reader, "presets", kPresets, &settings.presets);
  read_section(reader, "capture", kCapture, &settings.capture);
  read_belt(reader, settings.belt);
  read_roi(reader, settings.roi);
  read_calibration(reader, settings.calibration);
  read_section(reader, "realtime", kRealtime, &settings.realtime);
  read_section(reader, "memory", kMemory, &settings.memory);
  read_section(reader, "state", kState, &settings.state);
  read_section(reader, "snapshots", kSnapshots, &settings.snapshots);
  read_section(reader, "recording", kRecording, &settings.recording);
  reader.require("camera");
  settings.camera = *reader.take_table("camera");
  ConfigReader(settings.camera).require("driver");
  read_section(reader, "fieldbus", modbus_fields(), &settings.fieldbus);
  reader.finish();
  return settings;
}

Settings load_settings(const std::filesystem::path& file,
                       const std::vector<std::string>& overrides) {
  ConfigTable root = load_config(file);
  for (const std::string& assignment : overrides) apply_override(root, assignment);
  const std::filesystem::path folder = std::filesystem::absolute(file).parent_path();
  return read_settings(root, file, folder);
}

}  // namespace grapnel
