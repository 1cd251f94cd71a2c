#include "drivers/synthetic/synthetic_options.h"

#include <array>
#include <filesystem>
#include <string_view>

namespace grapnel {
namespace {

constexpr std::array<std::string_view, 2> kModes = {"true_time", "fast"};

}  // namespace

FieldTable SyntheticOptions::fields() noexcept {
  using O = SyntheticOptions;
  static constexpr std::array kFields = {
      text_field<&O::scene>("scene", "the scene's file, relative to this one"),
      choice_field<&O::mode>("mode", kModes, "when frames are handed out"),
      bool_field<&O::loop>("loop", "begin again after the scene's last frame"),
      text_field<&O::serial>("serial", "serial number of the unit to open; \"\" opens any"),
  };
  return kFields;
}

SyntheticOptions read_synthetic_options(const ConfigTable& camera) {
  SyntheticOptions options;
  ConfigReader reader(camera);
  reader.take_text("driver", "");
  reader.require("scene");
  reader.take_fields(SyntheticOptions::fields(), &options);
  reader.finish();
  const std::filesystem::path folder = std::filesystem::path(camera.file()).parent_path();
  options.scene = (folder / options.scene).string();
  return options;
}

}  // namespace grapnel
