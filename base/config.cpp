#include "base/config.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <sstream>
#include <system_error>

namespace grapnel {
/// What the parser takes for granted did not hold: the text is at fault, in every kind of build.
struct BrokenAssumption {};
}  // namespace grapnel
#define TOML_EXCEPTIONS 1
#define TOML_ASSERT(expression) \
  ((expression) ? static_cast<void>(0) : throw grapnel::BrokenAssumption())
// Without this a release build takes its assertions for true, and undefined behaviour follows.
#pragma push_macro("NDEBUG")
#undef NDEBUG
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")

#include "base/config_text.h"

namespace grapnel {
namespace {

// Deeper nesting than any configuration needs; the parser recurses.
constexpr int kMaxDepth = 16;

std::string where(const std::string& file, int line) {
  return line > 0 ? file + ":" + std::to_string(line) : file;
}

ConfigTable convert(const toml::table& source, const std::string& file, const std::string& path,
                    int depth);

ConfigValue convert_value(const toml::node& node, const std::string& file, const std::string& path,
                          int depth) {
  ConfigValue value;
  value.line = static_cast<int>(node.source().begin.line);
  if (depth > kMaxDepth) {
    throw InputError(one_line(where(file, value.line) + ": " + path + ": nested deeper than " +
                              std::to_string(kMaxDepth) + " levels"));
  }
  if (const auto* boolean = node.as_boolean()) {
    value.data = boolean->get();
  } else if (const auto* integer = node.as_integer()) {
    value.data = integer->get();
  } else if (const auto* real = node.as_floating_point()) {
    value.data = real->get();
  } else if (const auto* text = node.as_string()) {
    value.data = text->get();
  } else if (const auto* table = node.as_table()) {
    value.data = std::vector<ConfigTable>{convert(*table, file, path, depth + 1)};
  } else if (const auto* array = node.as_array()) {
    const bool tables =
        !array->empty() &&
        std::all_of(array->begin(), array->end(), [](const auto& item) { return item.is_table(); });
    if (tables) {
      std::vector<ConfigTable> list;
      for (const toml::node& item : *array)
        list.push_back(convert(*item.as_table(), file, path, depth + 1));
      value.data = std::move(list);
    } else {
      std::vector<ConfigValue> list;
      for (const toml::node& item : *array)
        list.push_back(convert_value(item, file, path, depth + 1));
      value.data = std::move(list);
    }
  } else {
    throw InputError(
        one_line(where(file, value.line) + ": " + path + ": dates and times have no use here"));
  }
  return value;
}

ConfigTable convert(const toml::table& source, const std::string& file, const std::string& path,
                    int depth) {
  ConfigTable table(file, path, static_cast<int>(source.source().begin.line));
  std::vector<std::pair<std::string, ConfigValue>> entries;
  for (const auto& [key, node] : source) {
    const std::string name(key.str());
    const std::string below = path.empty() ? name : path + "." + name;
    entries.emplace_back(name, convert_value(node, file, below, depth));
  }
  std::stable_sort(entries.begin(), entries.end(),
                   [](const auto& a, const auto& b) { return a.second.line < b.second.line; });
  for (auto& [name, value] : entries) table.set(name, std::move(value));
  return table;
}

ConfigTable parse(std::string_view text, const std::string& file_name) {
  try {
    return convert(toml::parse(text, file_name), file_name, "", 0);
  } catch (const toml::parse_error& error) {
    throw InputError(one_line(where(file_name, static_cast<int>(error.source().begin.line)) +
                              ": not valid TOML: " + std::string(error.description())));
  } catch (const BrokenAssumption&) {
    throw InputError(one_line(file_name + ": not valid TOML: a key or value is cut off"));
  }
}

/// The tables with this name, one new one where there is none.
std::vector<ConfigTable>& tables_named(ConfigTable& parent, const std::string& name,
                                       const std::string& path, const std::string& key) {
  const ConfigValue* held = parent.find(name);
  if (held == nullptr || !std::holds_alternative<std::vector<ConfigTable>>(held->data)) {
    ConfigValue fresh;
    fresh.data = std::vector<ConfigTable>{ConfigTable("--set " + key, path, 0)};
    parent.set(name, std::move(fresh));
    held = parent.find(name);
  }
  return std::get<std::vector<ConfigTable>>(const_cast<ConfigValue*>(held)->data);
}

/// Reads "2." at `begin` of the key as the second table of the list, which may be a new one, and
/// moves `begin` on. Else the first. Throws InputError.
std::size_t take_place(const std::string& key, std::size_t& begin, const std::string& path,
                       std::vector<ConfigTable>& list) {
  const std::size_t end = key.find('.', begin);
  std::size_t place = 0;
  if (end == std::string::npos || end == begin || end - begin > 3) return 0;
  for (std::size_t i = begin; i < end; ++i) {
    if (key[i] < '0' || key[i] > '9') return 0;
    place = 10 * place + static_cast<std::size_t>(key[i] - '0');
  }
  if (place < 1 || place > list.size() + 1) {
    throw InputError("--set " + key + ": " + path + " has " + std::to_string(list.size()) +
                     " tables; 1 to " + std::to_string(list.size() + 1) + " is allowed");
  }
  if (place > list.size()) list.emplace_back("--set " + key, path, 0);
  begin = end + 1;
  return place - 1;
}

}  // namespace

ConfigTable::ConfigTable() = default;
ConfigTable::ConfigTable(std::string file, std::string path, int line)
    : file_(std::move(file)), path_(std::move(path)), line_(line) {}
ConfigTable::ConfigTable(const ConfigTable& other) = default;
ConfigTable::ConfigTable(ConfigTable&& other) noexcept = default;
ConfigTable& ConfigTable::operator=(const ConfigTable& other) = default;
ConfigTable& ConfigTable::operator=(ConfigTable&& other) noexcept = default;
ConfigTable::~ConfigTable() = default;

const ConfigValue* ConfigTable::find(std::string_view key) const noexcept {
  for (const auto& [name, value] : entries_) {
    if (name == key) return &value;
  }
  return nullptr;
}

void ConfigTable::set(std::string_view key, ConfigValue value) {
  for (auto& [name, held] : entries_) {
    if (name == key) {
      held = std::move(value);
      return;
    }
  }
  entries_.emplace_back(std::string(key), std::move(value));
}

void ConfigTable::drop_lines() {
  std::erase_if(entries_, [](const auto& entry) { return entry.second.line > 0; });
}

ConfigTable load_config(const std::filesystem::path& file) {
  std::error_code code;
  const std::uintmax_t bytes = std::filesystem::file_size(file, code);
  if (code) throw InputError(file.string() + ": can't be read: " + code.message());
  if (bytes > kMaxConfigBytes) {
    throw InputError(file.string() + ": " + std::to_string(bytes) +
                     " bytes; a configuration file has at most " + std::to_string(kMaxConfigBytes));
  }
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(file.string() + ": can't be opened for reading");
  const std::string text((std::istreambuf_iterator<char>(stream)),
                         std::istreambuf_iterator<char>());
  return parse(text, file.string());
}

ConfigTable parse_config(std::string_view text, const std::string& file_name) {
  return parse(text, file_name);
}

void apply_override(ConfigTable& root, std::string_view assignment) {
  if (assignment.find_first_of("\r\n") != std::string_view::npos) {
    throw InputError("--set: a line break is not allowed; key=value in one line is");
  }
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos || equals == 0) {
    throw InputError("--set " + std::string(assignment) + ": expected key=value");
  }
  const std::string key(assignment.substr(0, equals));
  const std::string text(assignment.substr(equals + 1));
  ConfigValue value;
  try {
    value = *parse("value = " + text, "--set " + key).find("value");
  } catch (const InputError&) {
    value.data = text;
  }
  value.line = 0;
  ConfigTable* table = &root;
  std::string path;
  std::size_t begin = 0;
  for (std::size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.', begin)) {
    const std::string name = key.substr(begin, dot - begin);
    path += path.empty() ? name : "." + name;
    std::vector<ConfigTable>& list = tables_named(*table, name, path, key);
    begin = dot + 1;
    table = &list[take_place(key, begin, path, list)];
  }
  const std::string name = key.substr(begin);
  if (name == "method") {
    const ConfigValue* held = table->find(name);
    const auto* before = held == nullptr ? nullptr : std::get_if<std::string>(&held->data);
    const auto* after = std::get_if<std::string>(&value.data);
    if (before == nullptr || after == nullptr || *before != *after) table->drop_lines();
  }
  table->set(name, std::move(value));
}

}  // namespace grapnel
