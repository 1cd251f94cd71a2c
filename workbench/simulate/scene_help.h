#pragma once

#include <string>

namespace grapnel {

/// Every table and key of SCENE.toml: default, unit, range and meaning, a line a key.
[[nodiscard]] std::string scene_help();

}  // namespace grapnel
