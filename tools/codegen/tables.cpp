#include "tools/codegen/tables.h"

#include "base/assert.h"
#include "base/config.h"

namespace grapnel::codegen {
namespace {

constexpr std::int64_t kLastAddress = 65535;

std::string required_text(ConfigReader& reader, const char* key) {
  reader.require(key);
  return reader.take_text(key, "");
}

std::uint16_t number(ConfigReader& reader, const char* key, std::int64_t fallback) {
  return static_cast<std::uint16_t>(reader.take_integer(key, 0, kLastAddress, fallback));
}

std::uint16_t required_number(ConfigReader& reader, const char* key) {
  reader.require(key);
  return number(reader, key, 0);
}

RegisterRow read_register(const ConfigTable& table, int end_of_previous, int end_of_block) {
  ConfigReader reader(table);
  RegisterRow row;
  row.address = required_number(reader, "address");
  row.name = required_text(reader, "name");
  row.type = required_text(reader, "type");
  row.count = number(reader, "count", 1);
  row.scale = reader.take_number("scale", 0.0, 1.0, 1.0);
  row.unit = reader.take_text("unit", "");
  row.meaning = required_text(reader, "meaning");
  row.bits = reader.take_texts("bits");
  reader.finish();
  if (row.type != "u16" && row.type != "bits" && row.type != "u32" && row.type != "i32" &&
      row.type != "f32") {
    throw reader.problem("type", "\"" + row.type + "\" is not allowed; u16, bits, u32, i32, f32");
  }
  if (row.address < end_of_previous) throw reader.problem("address", "overlaps the row before");
  if (row.end() > end_of_block) throw reader.problem("address", "leaves its block");
  return row;
}

std::vector<RegisterRow> read_registers(ConfigReader& reader, int first, int end_of_block) {
  std::vector<RegisterRow> rows;
  int end = first;
  for (const ConfigTable* table : reader.take_tables("register")) {
    rows.push_back(read_register(*table, end, end_of_block));
    end = rows.back().end();
  }
  return rows;
}

BlockRow read_block(const ConfigTable& table) {
  ConfigReader reader(table);
  BlockRow block;
  block.id = required_text(reader, "id");
  block.title = required_text(reader, "title");
  block.first = required_number(reader, "first");
  block.last = required_number(reader, "last");
  block.access = required_text(reader, "access");
  block.note = reader.take_text("note", "");
  block.stride = number(reader, "stride", 0);
  block.count = number(reader, "count", 1);
  block.record = reader.take_text("record", "");
  block.record_first = number(reader, "record_first", 0);
  const int span = block.stride != 0 ? block.first + block.stride : block.last + 1;
  block.registers = read_registers(reader, block.first, span);
  reader.finish();
  return block;
}

RecordRow read_record(const ConfigTable& table) {
  ConfigReader reader(table);
  RecordRow record;
  record.id = required_text(reader, "id");
  record.title = required_text(reader, "title");
  record.length = required_number(reader, "length");
  record.note = reader.take_text("note", "");
  record.registers = read_registers(reader, 0, record.length);
  reader.finish();
  return record;
}

CommandRow read_command(const ConfigTable& table) {
  ConfigReader reader(table);
  CommandRow row;
  row.code = required_number(reader, "code");
  row.name = required_text(reader, "name");
  row.meaning = required_text(reader, "meaning");
  reader.finish();
  return row;
}

PoseFormatRow read_pose_format(const ConfigTable& table) {
  ConfigReader reader(table);
  PoseFormatRow row;
  row.id = required_number(reader, "id");
  row.parameters = required_text(reader, "parameters");
  row.unit = required_text(reader, "unit");
  row.scale = reader.take_number("scale", 0.0, 1.0, 0.0);
  row.rotation = required_text(reader, "rotation");
  row.brands = required_text(reader, "brands");
  reader.finish();
  return row;
}

}  // namespace

const BlockRow& RegisterMap::block(const std::string& id) const {
  for (const BlockRow& row : blocks) {
    if (row.id == id) return row;
  }
  throw InputError("register map: block \"" + id + "\" is missing");
}

std::vector<CodeRow> load_codes(const std::filesystem::path& file) {
  const ConfigTable root = load_config(file);
  ConfigReader reader(root);
  std::vector<CodeRow> rows;
  for (const ConfigTable* table : reader.take_tables("code")) {
    ConfigReader row_reader(*table);
    CodeRow row;
    row.number = required_number(row_reader, "number");
    row.id = required_text(row_reader, "id");
    row.text = required_text(row_reader, "text");
    row.meaning = required_text(row_reader, "meaning");
    row.remedy = required_text(row_reader, "remedy");
    row_reader.finish();
    if (!rows.empty() && row.number <= rows.back().number) {
      throw row_reader.problem("number", "codes must ascend");
    }
    rows.push_back(row);
  }
  reader.finish();
  return rows;
}

RegisterMap load_register_map(const std::filesystem::path& file) {
  const ConfigTable root = load_config(file);
  ConfigReader reader(root);
  RegisterMap map;
  reader.require("map");
  ConfigReader head(*reader.take_table("map"));
  map.major = required_number(head, "major");
  map.minor = required_number(head, "minor");
  map.first_read_only = required_number(head, "first_read_only");
  map.last_read_only = required_number(head, "last_read_only");
  map.registers_max = required_number(head, "registers_max");
  head.finish();
  int end = 0;
  for (const ConfigTable* table : reader.take_tables("block")) {
    map.blocks.push_back(read_block(*table));
    if (map.blocks.back().first < end) {
      throw ConfigReader(*table).problem("first", "overlaps the block before");
    }
    end = map.blocks.back().last + 1;
  }
  reader.require("record");
  map.record = read_record(*reader.take_tables("record").front());
  for (const ConfigTable* t : reader.take_tables("command")) {
    map.commands.push_back(read_command(*t));
  }
  for (const ConfigTable* t : reader.take_tables("pose_format")) {
    map.pose_formats.push_back(read_pose_format(*t));
  }
  reader.finish();
  return map;
}

}  // namespace grapnel::codegen
