#include <algorithm>
#include <variant>

#include "firmware_app/settings.h"

namespace grapnel {
namespace {

bool same_table(const ConfigTable& a, const ConfigTable& b);

bool same_value(const ConfigValue& a, const ConfigValue& b) {
  if (a.data.index() != b.data.index()) return false;
  if (const auto* list = std::get_if<std::vector<ConfigValue>>(&a.data)) {
    const auto& other = std::get<std::vector<ConfigValue>>(b.data);
    return std::equal(list->begin(), list->end(), other.begin(), other.end(), same_value);
  }
  if (const auto* tables = std::get_if<std::vector<ConfigTable>>(&a.data)) {
    const auto& other = std::get<std::vector<ConfigTable>>(b.data);
    return std::equal(tables->begin(), tables->end(), other.begin(), other.end(), same_table);
  }
  if (const auto* boolean = std::get_if<bool>(&a.data)) return *boolean == std::get<bool>(b.data);
  if (const auto* whole = std::get_if<std::int64_t>(&a.data)) {
    return *whole == std::get<std::int64_t>(b.data);
  }
  if (const auto* real = std::get_if<double>(&a.data)) return *real == std::get<double>(b.data);
  return std::get<std::string>(a.data) == std::get<std::string>(b.data);
}

bool same_table(const ConfigTable& a, const ConfigTable& b) {
  if (a.entries().size() != b.entries().size()) return false;
  return std::all_of(a.entries().begin(), a.entries().end(), [&b](const auto& entry) {
    const ConfigValue* other = b.find(entry.first);
    return other != nullptr && same_value(entry.second, *other);
  });
}

template <class Section>
bool same_fields(FieldTable fields, const Section& a, const Section& b) {
  return std::all_of(fields.begin(), fields.end(), [&](const Field& field) {
    return field_value_text(field, &a) == field_value_text(field, &b);
  });
}

FieldTable fields_of(std::string_view name) {
  for (const SettingsSection& section : settings_sections()) {
    if (section.name == name) return section.fields;
  }
  return {};
}

}  // namespace

std::string needs_restart(const Settings& running, const Settings& wanted) {
  std::string names;
  const auto name_if = [&names](bool differs, const char* name) {
    if (differs) names.append(names.empty() ? "" : ", ").append(name);
  };
  name_if(running.general.auto_arm != wanted.general.auto_arm, "auto_arm");
  name_if(!same_table(running.camera, wanted.camera), "[camera]");
  name_if(!same_fields(fields_of("fieldbus"), running.fieldbus, wanted.fieldbus), "[fieldbus]");
  name_if(!same_fields(fields_of("capture"), running.capture, wanted.capture), "[capture]");
  name_if(!same_fields(fields_of("belt"), running.belt, wanted.belt), "[belt]");
  name_if(running.calibration.serial != wanted.calibration.serial, "calibration.serial");
  name_if(!same_fields(fields_of("realtime"), running.realtime, wanted.realtime), "[realtime]");
  name_if(!same_fields(fields_of("memory"), running.memory, wanted.memory), "[memory]");
  name_if(!same_fields(fields_of("state"), running.state, wanted.state), "[state]");
  name_if(!same_fields(fields_of("snapshots"), running.snapshots, wanted.snapshots), "[snapshots]");
  name_if(!same_fields(fields_of("recording"), running.recording, wanted.recording), "[recording]");
  return names;
}

}  // namespace grapnel
