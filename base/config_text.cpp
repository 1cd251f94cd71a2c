#include "base/config_text.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <string_view>
#include <variant>

#include "base/formats/text_writer.h"

namespace grapnel {
namespace {

std::string inline_table(const ConfigTable& table);

struct ValueText {
  std::string operator()(bool value) const { return value ? "true" : "false"; }
  std::string operator()(std::int64_t value) const { return std::to_string(value); }
  std::string operator()(double value) const { return real_text(value); }
  std::string operator()(const std::string& value) const { return quoted_text(value); }
  std::string operator()(const std::vector<ConfigValue>& list) const {
    std::string out = "[";
    for (const ConfigValue& item : list) {
      if (&item != list.data()) out += ", ";
      out += std::visit(*this, item.data);
    }
    return out + "]";
  }
  std::string operator()(const std::vector<ConfigTable>& tables) const {
    if (tables.size() == 1) return inline_table(tables.front());
    std::string out = "[";
    for (const ConfigTable& table : tables) {
      if (&table != tables.data()) out += ", ";
      out += inline_table(table);
    }
    return out + "]";
  }
};

std::string inline_table(const ConfigTable& table) {
  std::string out = "{";
  for (const auto& [key, value] : table.entries()) {
    if (out.size() > 1) out += ", ";
    out += quoted_text(key);
    out += " = ";
    out += std::visit(ValueText{}, value.data);
  }
  return out + "}";
}

}  // namespace

std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(),
      [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, ' ');
  return text;
}

std::string quoted_text(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (code < 0x20 || code == 0x7f) {
      std::array<char, 8> escape{};
      std::snprintf(escape.data(), escape.size(), "\\u%04x", static_cast<unsigned>(code));
      out += escape.data();
    } else {
      out += c;
    }
  }
  return out + '"';
}

std::string real_text(double value) {
  std::string text;
  append_number(text, value);
  // Without one of these it would be read back as a whole number.
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

std::string toml_text(const ConfigValue& value) { return std::visit(ValueText{}, value.data); }

std::string config_text(const ConfigTable& table) {
  std::string out;
  for (const auto& [key, value] : table.entries()) {
    out += quoted_text(key);
    out += " = ";
    out += std::visit(ValueText{}, value.data);
    out += '\n';
  }
  return out;
}

}  // namespace grapnel
