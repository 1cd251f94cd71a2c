#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace grapnel {

/// Text as HTML shows it.
[[nodiscard]] std::string html_escaped(std::string_view text);
/// With `digits` decimals; a dash for what is not a finite number.
[[nodiscard]] std::string html_number(double value, int digits);
[[nodiscard]] std::string html_number(const nlohmann::ordered_json& value, double scale,
                                      int digits);

/// <table> of cells that are HTML already.
[[nodiscard]] std::string html_table(const std::vector<std::string>& head,
                                     const std::vector<std::vector<std::string>>& rows);

/// The tables of a summary.json: presets, groups, confusion, codes, times; each with its heading.
[[nodiscard]] std::string html_summary(const nlohmann::ordered_json& summary);

}  // namespace grapnel
