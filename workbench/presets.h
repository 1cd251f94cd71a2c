#pragma once

#include <filesystem>
#include <string>

namespace grapnel {

/// The folder with presets/ and models/: `config` in the working folder or beside or above the
/// program, as in a source tree or an installation. Throws InputError when there is none.
[[nodiscard]] std::filesystem::path config_folder();

/// A preset given by path ("my/box.toml"), name ("box") or number ("3"). Throws InputError naming
/// what there is.
[[nodiscard]] std::filesystem::path preset_file(const std::string& preset);

/// Where a preset's relative model paths start.
[[nodiscard]] std::filesystem::path models_folder(const std::filesystem::path& preset);

}  // namespace grapnel
