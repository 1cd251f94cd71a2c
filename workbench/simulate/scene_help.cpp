#include "workbench/simulate/scene_help.h"

#include <sstream>
#include <string_view>

#include "base/config.h"
#include "drivers/synthetic/scene_keys.h"

namespace grapnel {
namespace {

std::string allowed_text(const Field& field) {
  std::ostringstream text;
  const bool ranged = field.kind == FieldKind::Integer || field.kind == FieldKind::Real ||
                      field.kind == FieldKind::Numbers;
  if (ranged) {
    if (!field.unit.empty()) text << field.unit << ", ";
    text << field.minimum << " to " << field.maximum;
  }
  for (const std::string_view choice : field.choices) {
    text << (choice == field.choices.front() ? "" : " | ") << choice;
  }
  return text.str().empty() ? "" : " (" + text.str() + ")";
}

}  // namespace

std::string scene_help() {
  std::ostringstream text;
  text << "Keys of SCENE.toml, with their defaults:\n";
  for (const SceneSection& section : scene_sections()) {
    text << section.name << "\n";
    for (const Field& field : section.fields) {
      text << "  " << field.name << " = " << field_value_text(field, section.defaults)
           << allowed_text(field) << ": " << field.help << "\n";
    }
  }
  return text.str();
}

}  // namespace grapnel
