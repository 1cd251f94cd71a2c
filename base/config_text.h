#pragma once

#include <string>

#include "base/config.h"

namespace grapnel {

/// The table as TOML text, one line a key; sub-tables are written inline. parse_config() reads it
/// back as the same keys and values.
[[nodiscard]] std::string config_text(const ConfigTable& table);

}  // namespace grapnel
