#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace grapnel::codegen {

/// One row of base/codes.toml.
struct CodeRow {
  std::uint16_t number = 0;
  std::string id;
  std::string text;
  std::string meaning;
  std::string remedy;
};

/// One named register, or an array of `count` of them.
struct RegisterRow {
  std::uint16_t address = 0;  ///< 0-based; in a record the offset
  std::string name;
  std::string type;  ///< u16, bits, u32, i32, f32
  std::uint16_t count = 1;
  double scale = 1.0;  ///< value = raw × scale; 0: by POSE_FORMAT
  std::string unit;
  std::string meaning;
  std::vector<std::string> bits;  ///< "N NAME"

  [[nodiscard]] std::uint16_t words() const noexcept {
    return type == "u16" || type == "bits" ? 1 : 2;
  }
  [[nodiscard]] std::uint16_t end() const noexcept {
    return static_cast<std::uint16_t>(address + words() * count);
  }
};

/// A range of addresses; with a stride it repeats `count` times.
struct BlockRow {
  std::string id;
  std::string title;
  std::uint16_t first = 0;
  std::uint16_t last = 0;
  std::string access;
  std::string note;
  std::uint16_t stride = 0;
  std::uint16_t count = 1;
  std::string record;  ///< id of the record inside, or ""
  std::uint16_t record_first = 0;
  std::vector<RegisterRow> registers;
};

/// A group of registers at offsets, used by blocks.
struct RecordRow {
  std::string id;
  std::string title;
  std::uint16_t length = 0;
  std::string note;
  std::vector<RegisterRow> registers;
};

struct CommandRow {
  std::uint16_t code = 0;
  std::string name;
  std::string meaning;
};

struct PoseFormatRow {
  std::uint16_t id = 0;
  std::string parameters;
  std::string unit;
  double scale = 0.0;
  std::string rotation;
  std::string brands;
};

/// drivers/modbus/register_map.toml.
struct RegisterMap {
  std::uint16_t major = 0;
  std::uint16_t minor = 0;
  std::uint16_t first_read_only = 0;
  std::uint16_t last_read_only = 0;
  std::uint16_t registers_max = 0;
  std::vector<BlockRow> blocks;
  RecordRow record;
  std::vector<CommandRow> commands;
  std::vector<PoseFormatRow> pose_formats;

  /// Precondition: the block exists.
  [[nodiscard]] const BlockRow& block(const std::string& id) const;
};

/// Both throw InputError (file, line, key) when the file can't be used: a key missing or unknown,
/// numbers that do not ascend, registers that overlap or leave their block.
[[nodiscard]] std::vector<CodeRow> load_codes(const std::filesystem::path& file);
[[nodiscard]] RegisterMap load_register_map(const std::filesystem::path& file);

}  // namespace grapnel::codegen
