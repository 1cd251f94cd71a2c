#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "base/field.h"
#include "base/input_error.h"

namespace grapnel {

class ConfigTable;

/// One value of a configuration file, with the line it stands on (0: from the command line).
struct ConfigValue {
  std::variant<bool, std::int64_t, double, std::string, std::vector<ConfigValue>,
               std::vector<ConfigTable>>
      data;
  int line = 0;
};

/// A table of a configuration file: keys in file order. A sub-table is a list of one table.
class ConfigTable {
 public:
  ConfigTable();
  ConfigTable(std::string file, std::string path, int line);
  // Defined where ConfigValue, which holds tables itself, can be taken apart.
  ConfigTable(const ConfigTable& other);
  ConfigTable(ConfigTable&& other) noexcept;
  ConfigTable& operator=(const ConfigTable& other);
  ConfigTable& operator=(ConfigTable&& other) noexcept;
  ~ConfigTable();

  [[nodiscard]] const ConfigValue* find(std::string_view key) const noexcept;
  void set(std::string_view key, ConfigValue value);
  /// Removes what a file says; what the command line said stays.
  void drop_lines();
  [[nodiscard]] const std::vector<std::pair<std::string, ConfigValue>>& entries() const noexcept {
    return entries_;
  }
  [[nodiscard]] const std::string& file() const noexcept { return file_; }
  /// Dotted path from the root, "" for the root.
  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  [[nodiscard]] int line() const noexcept { return line_; }

 private:
  std::string file_;
  std::string path_;
  int line_ = 0;
  std::vector<std::pair<std::string, ConfigValue>> entries_;
};

/// Largest configuration file that is read at all.
inline constexpr std::uintmax_t kMaxConfigBytes = 1u << 20;

/// A configuration file as it is. Throws InputError when it can't be read or is larger than
/// kMaxConfigBytes.
[[nodiscard]] std::string read_config_text(const std::filesystem::path& file);

/// Reads a TOML file. Throws InputError (file, line, what) as read_config_text() does, and when it
/// is not TOML or has a key twice.
[[nodiscard]] ConfigTable load_config(const std::filesystem::path& file);
[[nodiscard]] ConfigTable parse_config(std::string_view text, const std::string& file_name);

/// Applies "a.b.c=value" (value in TOML syntax; a bare word counts as text) over a table. A number
/// after a table's name is a place in a list of tables, from 1; one past the end adds a table.
/// Another "method" than the table had starts that table anew: the old method's keys go.
void apply_override(ConfigTable& root, std::string_view assignment);

/// Takes a table apart key by key. Each take_… names file, line, key, value and what is allowed in
/// the InputError it throws. finish() refuses keys that nobody took, with the nearest known one.
class ConfigReader {
 public:
  explicit ConfigReader(const ConfigTable& table) : table_(&table) {}

  /// Fills the fields present; absent keys keep what the struct holds.
  void take_fields(FieldTable fields, void* object);
  [[nodiscard]] bool has(std::string_view key) const noexcept {
    return table_->find(key) != nullptr;
  }
  /// nullptr when absent.
  const ConfigTable* take_table(std::string_view key);
  /// Empty when absent. A single table counts as a list of one.
  std::vector<const ConfigTable*> take_tables(std::string_view key);
  /// `fallback` when absent.
  std::string take_text(std::string_view key, std::string_view fallback);
  double take_number(std::string_view key, double minimum, double maximum, double fallback);
  std::int64_t take_integer(std::string_view key, std::int64_t minimum, std::int64_t maximum,
                            std::int64_t fallback);
  bool take_bool(std::string_view key, bool fallback);
  std::vector<double> take_numbers(std::string_view key,
                                   std::size_t count);  ///< count 0: any; empty if absent
  std::vector<std::string> take_texts(std::string_view key);
  /// Throws InputError when `key` is absent.
  void require(std::string_view key) const;
  /// Throws InputError for the first key that nobody took.
  void finish() const;

  /// An InputError about `key`: "FILE:LINE: PATH.KEY: TEXT".
  [[nodiscard]] InputError problem(std::string_view key, std::string_view text) const;
  [[nodiscard]] const ConfigTable& table() const noexcept { return *table_; }

 private:
  const ConfigValue* take(std::string_view key);

  const ConfigTable* table_;
  std::vector<std::string> known_;
};

/// The known name nearest to `name` (Levenshtein distance at most a third of its length), or "".
[[nodiscard]] std::string nearest_name(std::string_view name,
                                       const std::vector<std::string>& known);

/// A field's value in TOML syntax.
[[nodiscard]] std::string field_value_text(const Field& field, const void* object);

}  // namespace grapnel
