#include "pipeline/preset.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <system_error>

#include "base/hash.h"
#include "base/input_error.h"
#include "pipeline/method_slots.h"
#include "pipeline/stage_set.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

constexpr std::uint16_t kMaxObjects = 8;

FieldTable preset_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&Preset::max_objects>("max_objects", "", 1, kMaxObjects,
                                         "objects reported from one frame"),
      number_field<&Preset::timeout_ms>("timeout_ms", "ms", 10, 60000,
                                        "job deadline when the PLC gives none"),
      number_field<&Preset::pose_format>("pose_format", "", 1, 7,
                                         "how poses are written for the PLC"),
      number_field<&Preset::retries>("retries", "", 0, 20, "further frames tried by command 24"),
      numbers_field<&Preset::pick_offset_m>(
          "pick_offset_m", "m", -2.0, 2.0,
          "x, y, z in the grasp's frame, added to every grasp; empty: none"),
      bool_field<&Preset::flip_z>(
          "flip_z", "turn the grasp's frame half round its x, for a flange whose z points up"),
  };
  return kFields;
}

/// NN of "NN-name.toml"; false for another name.
bool split_name(const fs::path& file, std::uint16_t& number, std::string& name) {
  const std::string stem = file.stem().string();
  const std::size_t dash = stem.find('-');
  if (dash == 0 || dash == std::string::npos || dash > 5) return false;
  unsigned value = 0;
  for (std::size_t i = 0; i < dash; ++i) {
    if (stem[i] < '0' || stem[i] > '9') return false;
    value = value * 10 + static_cast<unsigned>(stem[i] - '0');
  }
  if (value > 65535) return false;
  number = static_cast<std::uint16_t>(value);
  name = stem.substr(dash + 1);
  return true;
}

std::vector<fs::path> preset_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code failed;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, failed)) {
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  }
  if (failed) throw InputError(folder.string() + ": can't be read: " + failed.message());
  std::sort(files.begin(), files.end());
  return files;
}

template <class Match>
fs::path find_one(const fs::path& folder, const std::string& wanted, Match match) {
  std::string there;
  std::vector<fs::path> found;
  for (const fs::path& file : preset_files(folder)) {
    std::uint16_t number = 0;
    std::string name;
    if (!split_name(file, number, name)) continue;
    if (match(number, name)) found.push_back(file);
    there += (there.empty() ? "" : ", ") + file.stem().string();
  }
  if (found.empty()) {
    throw InputError(folder.string() + ": no preset " + wanted + "; there is: " + there);
  }
  if (found.size() > 1) {
    throw InputError(folder.string() + ": preset " + wanted + " is there twice: " +
                     found[0].filename().string() + ", " + found[1].filename().string());
  }
  return found[0];
}

fs::path model_file(const fs::path& folder, const std::string& name) {
  fs::path path = folder / name;
  if (path.has_extension()) return path;
  for (const char* ending : {".ply", ".pcd"}) {
    fs::path with_ending = path;
    with_ending += ending;
    if (fs::exists(with_ending)) return with_ending;
  }
  return fs::path(path.string() + ".ply");
}

std::vector<Model> load_models(ConfigReader& reader, const fs::path& folder) {
  std::vector<Model> models;
  for (const std::string& name : reader.take_texts("models")) {
    const fs::path file = model_file(folder, name);
    if (!fs::exists(file)) {
      throw reader.problem("models", "\"" + name + "\": no file " + file.string());
    }
    models.push_back(load_model(file));
    for (std::size_t i = 0; i + 1 < models.size(); ++i) {
      if (models[i].name == models.back().name) {
        throw reader.problem("models", "\"" + name + "\" is listed twice");
      }
    }
  }
  if (models.size() > 32) throw reader.problem("models", "more than 32");
  return models;
}

std::uint16_t fingerprint(const std::vector<Model>& models, std::string text,
                          const std::vector<std::string>& overrides) {
  for (const std::string& assignment : overrides) text += '\n' + assignment;
  for (const Model& model : models) text += '\n' + std::to_string(model.hash);
  return fingerprint16(std::as_bytes(std::span(text)));
}

}  // namespace

Preset load_preset(const fs::path& file, const fs::path& models_folder,
                   const std::vector<std::string>& overrides) {
  Preset preset;
  preset.file = file;
  preset.text = read_config_text(file);
  preset.source = parse_config(preset.text, file.string());
  for (const std::string& assignment : overrides) apply_override(preset.source, assignment);
  if (!split_name(file, preset.number, preset.name)) preset.name = file.stem().string();

  ConfigReader reader(preset.source);
  reader.take_text("description", "");
  reader.take_fields(preset_fields(), &preset);
  if (!preset.pick_offset_m.empty() && preset.pick_offset_m.size() != 3) {
    throw reader.problem("pick_offset_m", "a list of " +
                                              std::to_string(preset.pick_offset_m.size()) +
                                              " numbers is not allowed; 3 are");
  }
  if (const ConfigTable* limits = reader.take_table("limits")) {
    ConfigReader entry(*limits);
    entry.take_fields(limits_fields(), &preset.limits);
    entry.finish();
  }
  // The stages' own tables: taken apart once here, so that a wrong key is known before READY.
  const StageSet stages(preset.source);
  StageParams params;
  for (const ParamTable& table : param_tables(params)) reader.take_table(table.name);
  method_slots().each([&](const auto& slot) { reader.take_tables(slot.table); });
  preset.models = load_models(reader, models_folder);
  reader.finish();
  preset.fingerprint = fingerprint(preset.models, preset.text, overrides);
  return preset;
}

fs::path find_preset(const fs::path& folder, std::uint16_t number) {
  return find_one(folder, std::to_string(number),
                  [&](std::uint16_t n, const std::string&) { return n == number; });
}

fs::path find_preset(const fs::path& folder, const std::string& name) {
  return find_one(folder, name,
                  [&](std::uint16_t, const std::string& other) { return other == name; });
}

namespace {

void describe_field(const Field& field, const std::string& value, const char* prefix,
                    std::string& text) {
  text.append("# ").append(field.help);
  if (field.kind == FieldKind::Choice) {
    text += "; one of:";
    for (const std::string_view choice : field.choices) text.append(" ").append(choice);
  }
  if (field.kind == FieldKind::Integer || field.kind == FieldKind::Real) {
    std::string low = std::to_string(field.minimum);
    std::string high = std::to_string(field.maximum);
    for (std::string* number : {&low, &high}) {
      number->erase(number->find_last_not_of('0') + 1);
      if (number->ends_with('.')) number->pop_back();
    }
    text.append("; ").append(low).append(" to ").append(high);
  }
  if (!field.unit.empty()) text.append(" [").append(field.unit).append("]");
  text.append("\n").append(prefix).append(field.name).append(" = ").append(value).append("\n");
}

void describe_fields(FieldTable fields, const void* object, std::string& text) {
  for (const Field& field : fields)
    describe_field(field, field_value_text(field, object), "", text);
}

template <class StageKind>
void describe_methods(const MethodSlot<StageKind>& slot, std::string& text) {
  text.append("\n");
  if (slot.several) {
    text.append("# [[").append(slot.table).append("]] may stand several times, each with a method");
    text.append("; --set ").append(slot.table).append(".2.method=… adds a second\n");
  }
  text.append("[").append(slot.table).append("]\n# one of:");
  for (const Method<StageKind>& method : slot.methods) text.append(" ").append(method.name);
  text.append("\nmethod = \"").append(slot.fallback).append("\"\n");
  for (const Method<StageKind>& method : slot.methods) {
    const char* prefix = method.name == slot.fallback ? "" : "# ";
    text.append("# ").append(method.name).append(":\n");
    const FieldTable fields = method.fields();
    const ConfigTable over = slot_defaults(slot.defaults, method.name);
    for (std::size_t i = 0; i < fields.size(); ++i) {
      describe_field(fields[i], method.default_text(i, over), prefix, text);
    }
  }
}

}  // namespace

std::string describe_preset() {
  std::string text =
      "# Every key of a preset with its default.\n\ndescription = \"\"\n"
      "# models looked for, files of the models' folder; empty: given per call\n"
      "models = []\n";
  const Preset preset;
  describe_fields(preset_fields(), &preset, text);
  text += "\n[limits]\n";
  describe_fields(limits_fields(), &preset.limits, text);
  StageParams params;
  for (const ParamTable& table : param_tables(params)) {
    text.append("\n[").append(table.name).append("]\n");
    describe_fields(table.fields, table.object, text);
  }
  method_slots().each([&](const auto& slot) { describe_methods(slot, text); });
  return text;
}

}  // namespace grapnel
