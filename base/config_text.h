#pragma once

#include <string>
#include <string_view>

#include "base/config.h"

namespace grapnel {

/// The table as TOML text, one line a key; sub-tables are written inline. parse_config() reads it
/// back as the same keys and values.
[[nodiscard]] std::string config_text(const ConfigTable& table);

/// A value as TOML writes it; tables inline.
[[nodiscard]] std::string toml_text(const ConfigValue& value);

/// The text and the number as TOML writes them: escaped and in quotes; with a point or an exponent.
[[nodiscard]] std::string quoted_text(std::string_view text);
[[nodiscard]] std::string real_text(double value);

/// Control characters become spaces: keys and values may hold line breaks, a message about them is
/// one line all the same.
[[nodiscard]] std::string one_line(std::string text);

}  // namespace grapnel
