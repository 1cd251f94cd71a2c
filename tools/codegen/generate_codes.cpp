#include <algorithm>

#include "tools/codegen/generate.h"

namespace grapnel::codegen {
namespace {

constexpr std::size_t kColumns = 100;

constexpr const char* kNotice =
    "// Generated from base/codes.toml by grapnel-codegen. Do not edit.\n";

constexpr const char* kHeaderTop = R"(#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace grapnel {

/// Outcome of a job, a command or a part of the device, as the field bus reports it.
/// Thousands name the subsystem; hundreds 0 = error, 1 = normal.
enum class Code : std::uint16_t {
)";

constexpr const char* kHeaderEnd = R"(};

/// One row of the table of codes.
struct CodeEntry {
  Code code;
  std::string_view id;       ///< enumerator's name
  std::string_view text;     ///< short name, as in the register map
  std::string_view meaning;  ///< one sentence
  std::string_view remedy;   ///< what to do; empty for normal codes
};

/// Every code, ascending.
[[nodiscard]] std::span<const CodeEntry> code_table() noexcept;

/// The row of `code`, or the row of InternalFault for a number outside the table.
[[nodiscard]] const CodeEntry& describe(Code code) noexcept;

}  // namespace grapnel
)";

constexpr const char* kTableEnd = R"(}};

}  // namespace

std::span<const CodeEntry> code_table() noexcept { return kCodes; }

const CodeEntry& describe(Code code) noexcept {
  const CodeEntry* fallback = &kCodes.front();
  for (const CodeEntry& entry : kCodes) {
    if (entry.code == code) return entry;
    if (entry.code == Code::InternalFault) fallback = &entry;
  }
  return *fallback;
}

}  // namespace grapnel
)";

std::string quoted(const std::string& text) { return "\"" + text + "\""; }

// Fills lines as clang-format does for a braced list: as many items a line as fit.
std::string braced_row(const std::vector<std::string>& items) {
  std::string out;
  std::string line = "    {";
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::string item = items[i] + (i + 1 < items.size() ? "," : "},");
    const bool first = line.back() == '{' || line.back() == ' ';
    const std::size_t width = line.size() + (first ? 0 : 1) + item.size();
    if (!first && width > kColumns) {
      out += line + "\n";
      line = "     " + item;
    } else {
      line += (first ? "" : " ") + item;
    }
  }
  return out + line + "\n";
}

}  // namespace

std::string generate_code_header(const std::vector<CodeRow>& codes) {
  std::vector<std::pair<std::string, std::string>> rows;
  rows.emplace_back("Ok = 0,", "no error; never sent on the field bus");
  for (const CodeRow& code : codes) {
    rows.emplace_back(code.id + " = " + std::to_string(code.number) + ",", code.text);
  }
  std::size_t widest = 0;
  for (const auto& row : rows) widest = std::max(widest, row.first.size());
  std::string out = std::string(kNotice) + kHeaderTop;
  for (const auto& [left, right] : rows) {
    out += "  " + left + std::string(widest - left.size() + 2, ' ') + "///< " + right + "\n";
  }
  return out + kHeaderEnd;
}

std::string generate_code_table(const std::vector<CodeRow>& codes) {
  std::string out = kNotice;
  out +=
      "#include <array>\n\n#include \"base/code.h\"\n\nnamespace grapnel {\nnamespace {\n\n"
      "constexpr std::array<CodeEntry, " +
      std::to_string(codes.size()) + "> kCodes = {{\n";
  for (const CodeRow& code : codes) {
    out += braced_row({"Code::" + code.id, quoted(code.id), quoted(code.text), quoted(code.meaning),
                       quoted(code.remedy)});
  }
  return out + kTableEnd;
}

std::string generate_code_manual(const std::vector<CodeRow>& codes) {
  std::string out =
      "<!-- Generated from base/codes.toml by grapnel-codegen. Do not edit. -->\n"
      "# Status codes\n\n"
      "Four digits: thousands name the subsystem, hundreds 0 = error, 1 = normal. They appear in "
      "the "
      "registers\nSTATUS_CODE (what the device is at), ACK_CODE (a command's answer), RES_CODE (a "
      "job's outcome) and\nOBJ_CODE (an object's), in reports and in the journal.\n\n"
      "| code | name | meaning | what to do |\n| --- | --- | --- | --- |\n";
  for (const CodeRow& code : codes) {
    out += "| " + std::to_string(code.number) + " | " + code.text + " | " + code.meaning + " | " +
           (code.remedy.empty() ? "—" : code.remedy) + " |\n";
  }
  return out;
}

}  // namespace grapnel::codegen
