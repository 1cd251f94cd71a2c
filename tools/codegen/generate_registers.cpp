#include "tools/codegen/generate.h"

namespace grapnel::codegen {
namespace {

constexpr const char* kTop =
    R"(// Generated from drivers/modbus/register_map.toml by grapnel-codegen. Do not edit.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

/// Addresses (0-based) and types of the register map; docs/registers.md is its manual.
namespace grapnel::registers {

/// What a register holds. U32, I32 and F32 take two registers.
enum class RegisterType : std::uint8_t { U16, Bits, U32, I32, F32 };

/// One named register; `count` > 1 is an array. In the block "object" the address is an offset.
struct RegisterInfo {
  std::string_view block;
  std::string_view name;
  std::uint16_t address = 0;
  RegisterType type = RegisterType::U16;
  std::uint16_t count = 1;
};

)";

std::string type_name(const std::string& type) {
  if (type == "u16") return "U16";
  if (type == "bits") return "Bits";
  if (type == "u32") return "U32";
  if (type == "i32") return "I32";
  return "F32";
}

std::string constant(const std::string& comment, const std::string& name, int value) {
  return (comment.empty() ? "" : "/// " + comment + "\n") + "inline constexpr std::uint16_t " +
         name + " = " + std::to_string(value) + ";\n";
}

std::string register_constants(const std::vector<RegisterRow>& rows) {
  std::string out;
  for (const RegisterRow& row : rows) {
    out += constant(row.meaning, constant_name(row.name), row.address);
  }
  return out;
}

std::string table_rows(const std::string& block, const std::vector<RegisterRow>& rows) {
  std::string out;
  for (const RegisterRow& row : rows) {
    out += "    {\"" + block + "\", \"" + row.name + "\", " + std::to_string(row.address) +
           ", RegisterType::" + type_name(row.type) + ", " + std::to_string(row.count) + "},\n";
  }
  return out;
}

}  // namespace

std::string generate_register_header(const RegisterMap& map) {
  std::string out = kTop;
  out += constant("Major × 256 + minor.", "kMapVersion", map.major * 256 + map.minor);
  out += constant("The input registers, readable as holding registers too.", "kFirstReadOnly",
                  map.first_read_only);
  out += constant("", "kLastReadOnly", map.last_read_only);
  out += "\n";
  std::string rows;
  std::size_t count = 0;
  for (const BlockRow& block : map.blocks) {
    out += "/// " + block.title + ".\nnamespace " + block.id + " {\n";
    out += constant("", "kFirst", block.first);
    out += constant("", "kLast", block.last);
    if (block.stride != 0) {
      out += constant("Addresses are those of the first of kCount; the next is kStride further.",
                      "kStride", block.stride);
      out += constant("", "kCount", block.count);
    }
    if (!block.record.empty()) out += constant("", "kRecordFirst", block.record_first);
    out += register_constants(block.registers) + "}  // namespace " + block.id + "\n\n";
    rows += table_rows(block.id, block.registers);
    count += block.registers.size();
  }
  out += "/// " + map.record.title + ": offsets from its first register.\nnamespace " +
         map.record.id + " {\n";
  out += constant("", "kLength", map.record.length);
  out += register_constants(map.record.registers) + "}  // namespace " + map.record.id + "\n\n";
  rows += table_rows(map.record.id, map.record.registers);
  count += map.record.registers.size();
  out += "/// Every named register, blocks in address order, the object record last.\n";
  out += "inline constexpr std::array<RegisterInfo, " + std::to_string(count) +
         "> kRegisters = {{\n" + rows + "}};\n\n}  // namespace grapnel::registers\n";
  return out;
}

}  // namespace grapnel::codegen
