#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/config.h"
#include "pipeline/limits.h"
#include "pipeline/model.h"

namespace grapnel {

/// A preset as its file says it: what the registrar is built from. The stages' own tables stay in
/// `source` until the registry takes them apart.
struct Preset {
  std::uint16_t number = 0;  ///< NN of NN-name.toml; 0 for a preset given by path
  std::string name;
  std::filesystem::path file;
  std::uint16_t fingerprint = 0;  ///< PRESET_REV: of the file's and the models' bytes, never 0
  std::vector<Model> models;  ///< empty for a preset of pairs, or when the model is given per call
  Limits limits;
  std::uint16_t max_objects = 1;
  std::uint16_t timeout_ms = 500;  ///< job deadline when the PLC gives none
  std::uint16_t pose_format = 1;
  std::uint16_t retries = 0;  ///< further frames tried by command 24
  std::vector<double>
      pick_offset_m;    ///< x y z in the grasp's frame, added to every grasp; or empty
  bool flip_z = false;  ///< half a turn about x of the grasp's frame: its z points the other way
  std::string text;     ///< of the file
  ConfigTable source;   ///< the same read, overrides applied
};

/// Reads and checks a preset and its models (paths relative to `models_folder`). `overrides` are
/// "key=value" with the keys of describe-preset. Throws InputError.
[[nodiscard]] Preset load_preset(const std::filesystem::path& file,
                                 const std::filesystem::path& models_folder,
                                 const std::vector<std::string>& overrides = {});

/// The file NN-name.toml in `folder` with this number or this name. Throws InputError (what there
/// is).
[[nodiscard]] std::filesystem::path find_preset(const std::filesystem::path& folder,
                                                std::uint16_t number);
[[nodiscard]] std::filesystem::path find_preset(const std::filesystem::path& folder,
                                                const std::string& name);

/// Every key with unit, range, default and help, as a commented TOML file.
[[nodiscard]] std::string describe_preset();

}  // namespace grapnel
