#include "drivers/replay/replay_options.h"

#include <array>
#include <filesystem>
#include <string_view>

namespace grapnel {
namespace {

constexpr double kMaxFrames = 1e9;
constexpr std::array<std::string_view, 3> kModes = {"true_time", "fast", "stepped"};
constexpr std::array<std::string_view, 2> kOnBadFrame = {"error", "drop"};

}  // namespace

FieldTable ReplayOptions::fields() noexcept {
  using O = ReplayOptions;
  static constexpr std::array kFields = {
      text_field<&O::path>("path", "folder of the recording, relative to this file"),
      choice_field<&O::mode>("mode", kModes, "when frames are handed out"),
      number_field<&O::factor>("factor", "", 0.01, 100.0, "true_time: 2 plays twice as fast"),
      bool_field<&O::loop>("loop", "begin again at the end"),
      number_field<&O::start>("start", "", 0.0, kMaxFrames, "first frame"),
      number_field<&O::count>("count", "", 0.0, kMaxFrames, "frames from there; 0: to the end"),
      choice_field<&O::on_bad_frame>("on_bad_frame", kOnBadFrame,
                                     "a frame that can't be read ends the replay, or is dropped"),
  };
  return kFields;
}

ReplayOptions read_replay_options(const ConfigTable& camera) {
  ReplayOptions options;
  ConfigReader reader(camera);
  reader.take_text("driver", "");
  reader.require("path");
  reader.take_fields(ReplayOptions::fields(), &options);
  reader.finish();
  const std::filesystem::path folder = std::filesystem::path(camera.file()).parent_path();
  options.path = (folder / options.path).string();
  return options;
}

}  // namespace grapnel
