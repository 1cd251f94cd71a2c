#include <algorithm>
#include <cmath>
#include <cstddef>
#include <sstream>

#include "base/config.h"
#include "base/config_text.h"

namespace grapnel {
namespace {

std::string where(const std::string& file, int line) {
  return line > 0 ? file + ":" + std::to_string(line) : file;
}

std::string number_text(double value) {
  std::ostringstream stream;
  stream.precision(12);
  stream << value;
  return stream.str();
}

std::string in_quotes(std::string_view text) {
  std::string result = "\"";
  return result.append(text).append("\"");
}

std::string value_text(const ConfigValue& value) {
  struct Printer {
    std::string operator()(bool b) const { return b ? "true" : "false"; }
    std::string operator()(std::int64_t i) const { return std::to_string(i); }
    std::string operator()(double d) const { return number_text(d); }
    std::string operator()(const std::string& s) const {
      return in_quotes(s.size() > 60 ? s.substr(0, 60) + "…" : s);
    }
    std::string operator()(const std::vector<ConfigValue>& list) const {
      return "a list of " + std::to_string(list.size());
    }
    std::string operator()(const std::vector<ConfigTable>&) const { return "a table"; }
  };
  return std::visit(Printer{}, value.data);
}

bool as_number(const ConfigValue& value, double& out) {
  if (const auto* integer = std::get_if<std::int64_t>(&value.data)) {
    out = static_cast<double>(*integer);
    return true;
  }
  if (const auto* real = std::get_if<double>(&value.data)) {
    out = *real;
    return true;
  }
  return false;
}

std::string range_text(double minimum, double maximum, std::string_view unit) {
  std::string text = number_text(minimum) + " to " + number_text(maximum);
  if (!unit.empty()) text += " " + std::string(unit);
  return text;
}

/// "; did you mean …?" where one of the choices is near, else "".
std::string meant(const ConfigValue& value, std::span<const std::string_view> choices) {
  const auto* text = std::get_if<std::string>(&value.data);
  if (text == nullptr) return "";
  const std::string nearest = nearest_name(*text, {choices.begin(), choices.end()});
  return nearest.empty() ? "" : "; did you mean " + in_quotes(nearest) + "?";
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      const std::size_t substitute = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({above + 1, row[j - 1] + 1, substitute});
      diagonal = above;
    }
  }
  return row[b.size()];
}

}  // namespace

InputError ConfigReader::problem(std::string_view key, std::string_view text) const {
  const ConfigValue* value = table_->find(key);
  const int line = value != nullptr ? value->line : table_->line();
  std::string path = table_->path();
  if (!key.empty()) path.append(path.empty() ? "" : ".").append(key);
  const std::string place =
      value != nullptr && value->line == 0 ? "command line" : where(table_->file(), line);
  return InputError(one_line(place + ": " + (path.empty() ? "" : path + ": ") + std::string(text)));
}

const ConfigValue* ConfigReader::take(std::string_view key) {
  known_.emplace_back(key);
  return table_->find(key);
}

void ConfigReader::take_fields(FieldTable fields, void* object) {
  for (const Field& field : fields) {
    const ConfigValue* value = take(field.name);
    if (value == nullptr) continue;
    switch (field.kind) {
      case FieldKind::Bool: {
        const auto* boolean = std::get_if<bool>(&value->data);
        if (boolean == nullptr) {
          throw problem(field.name, value_text(*value) + " is not allowed; true or false is");
        }
        field.set_number(object, *boolean ? 1.0 : 0.0);
        break;
      }
      case FieldKind::Integer:
      case FieldKind::Real: {
        double number = 0.0;
        const bool whole = field.kind == FieldKind::Integer;
        if (!as_number(*value, number) || (whole && std::floor(number) != number)) {
          throw problem(field.name, value_text(*value) + " is not allowed; " +
                                        (whole ? "a whole number from " : "a number from ") +
                                        range_text(field.minimum, field.maximum, field.unit) +
                                        " is");
        }
        if (!(number >= field.minimum && number <= field.maximum)) {
          throw problem(field.name, number_text(number) + " is out of range; " +
                                        range_text(field.minimum, field.maximum, field.unit) +
                                        " is allowed");
        }
        field.set_number(object, number);
        break;
      }
      case FieldKind::Choice: {
        const auto* text = std::get_if<std::string>(&value->data);
        std::size_t index = field.choices.size();
        if (text != nullptr) {
          for (std::size_t i = 0; i < field.choices.size(); ++i) {
            if (field.choices[i] == *text) index = i;
          }
        }
        if (index == field.choices.size()) {
          std::string allowed;
          for (const std::string_view choice : field.choices) {
            allowed += (allowed.empty() ? "\"" : ", \"") + std::string(choice) + "\"";
          }
          throw problem(field.name, value_text(*value) + " is not allowed; one of " + allowed +
                                        " is" + meant(*value, field.choices));
        }
        field.set_number(object, static_cast<double>(index));
        break;
      }
      case FieldKind::Text: {
        const auto* text = std::get_if<std::string>(&value->data);
        if (text == nullptr)
          throw problem(field.name, value_text(*value) + " is not allowed; a text is");
        field.text(object) = *text;
        break;
      }
      case FieldKind::Numbers: {
        const auto* list = std::get_if<std::vector<ConfigValue>>(&value->data);
        if (list == nullptr) {
          throw problem(field.name, value_text(*value) + " is not allowed; a list of numbers is");
        }
        std::vector<double> numbers;
        for (const ConfigValue& item : *list) {
          double number = 0.0;
          if (!as_number(item, number) || !(number >= field.minimum && number <= field.maximum)) {
            throw problem(field.name,
                          value_text(item) + " is not allowed in the list; numbers from " +
                              range_text(field.minimum, field.maximum, field.unit) + " are");
          }
          numbers.push_back(number);
        }
        field.numbers(object) = std::move(numbers);
        break;
      }
      case FieldKind::Texts:
        field.texts(object) = take_texts(field.name);
        break;
    }
  }
}

const ConfigTable* ConfigReader::take_table(std::string_view key) {
  const ConfigValue* value = take(key);
  if (value == nullptr) return nullptr;
  const auto* tables = std::get_if<std::vector<ConfigTable>>(&value->data);
  if (tables == nullptr) throw problem(key, value_text(*value) + " is not allowed; a table is");
  if (tables->size() != 1)
    throw problem(key, "one table is allowed, here are " + std::to_string(tables->size()));
  return &tables->front();
}

std::vector<const ConfigTable*> ConfigReader::take_tables(std::string_view key) {
  const ConfigValue* value = take(key);
  if (value == nullptr) return {};
  const auto* tables = std::get_if<std::vector<ConfigTable>>(&value->data);
  if (tables == nullptr) throw problem(key, value_text(*value) + " is not allowed; tables are");
  std::vector<const ConfigTable*> list;
  for (const ConfigTable& table : *tables) list.push_back(&table);
  return list;
}

std::string ConfigReader::take_text(std::string_view key, std::string_view fallback) {
  const ConfigValue* value = take(key);
  if (value == nullptr) return std::string(fallback);
  const auto* text = std::get_if<std::string>(&value->data);
  if (text == nullptr) throw problem(key, value_text(*value) + " is not allowed; a text is");
  return *text;
}

double ConfigReader::take_number(std::string_view key, double minimum, double maximum,
                                 double fallback) {
  const ConfigValue* value = take(key);
  if (value == nullptr) return fallback;
  double number = 0.0;
  if (!as_number(*value, number) || !(number >= minimum && number <= maximum)) {
    throw problem(key, value_text(*value) + " is not allowed; a number from " +
                           range_text(minimum, maximum, "") + " is");
  }
  return number;
}

std::int64_t ConfigReader::take_integer(std::string_view key, std::int64_t minimum,
                                        std::int64_t maximum, std::int64_t fallback) {
  const ConfigValue* value = take(key);
  if (value == nullptr) return fallback;
  const auto* integer = std::get_if<std::int64_t>(&value->data);
  if (integer == nullptr || *integer < minimum || *integer > maximum) {
    throw problem(key, value_text(*value) + " is not allowed; a whole number from " +
                           std::to_string(minimum) + " to " + std::to_string(maximum) + " is");
  }
  return *integer;
}

bool ConfigReader::take_bool(std::string_view key, bool fallback) {
  const ConfigValue* value = take(key);
  if (value == nullptr) return fallback;
  const auto* boolean = std::get_if<bool>(&value->data);
  if (boolean == nullptr)
    throw problem(key, value_text(*value) + " is not allowed; true or false is");
  return *boolean;
}

std::vector<double> ConfigReader::take_numbers(std::string_view key, std::size_t count) {
  const ConfigValue* value = take(key);
  if (value == nullptr) return {};
  const auto* list = std::get_if<std::vector<ConfigValue>>(&value->data);
  if (list == nullptr || (count != 0 && list->size() != count)) {
    throw problem(
        key, value_text(*value) + " is not allowed; a list of " +
                 (count != 0 ? std::to_string(count) + " numbers is" : std::string("numbers is")));
  }
  std::vector<double> numbers;
  for (const ConfigValue& item : *list) {
    double number = 0.0;
    if (!as_number(item, number) || !std::isfinite(number)) {
      throw problem(key, value_text(item) + " is not allowed in the list; finite numbers are");
    }
    numbers.push_back(number);
  }
  return numbers;
}

std::vector<std::string> ConfigReader::take_texts(std::string_view key) {
  const ConfigValue* value = take(key);
  if (value == nullptr) return {};
  const auto* list = std::get_if<std::vector<ConfigValue>>(&value->data);
  if (list == nullptr)
    throw problem(key, value_text(*value) + " is not allowed; a list of texts is");
  std::vector<std::string> texts;
  for (const ConfigValue& item : *list) {
    const auto* text = std::get_if<std::string>(&item.data);
    if (text == nullptr)
      throw problem(key, value_text(item) + " is not allowed in the list; texts are");
    texts.push_back(*text);
  }
  return texts;
}

void ConfigReader::require(std::string_view key) const {
  if (!has(key)) throw problem("", "key \"" + std::string(key) + "\" is missing");
}

void ConfigReader::finish() const {
  for (const auto& [name, value] : table_->entries()) {
    if (std::find(known_.begin(), known_.end(), name) != known_.end()) continue;
    const std::string nearest = nearest_name(name, known_);
    throw problem(
        name, nearest.empty() ? "unknown key" : "unknown key; did you mean \"" + nearest + "\"?");
  }
}

std::string nearest_name(std::string_view name, const std::vector<std::string>& known) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, name.size() / 3) + 1;
  for (const std::string& candidate : known) {
    const std::size_t distance = edit_distance(name, candidate);
    if (distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

std::string field_value_text(const Field& field, const void* object) {
  switch (field.kind) {
    case FieldKind::Bool:
      return field.get_number(object) != 0.0 ? "true" : "false";
    case FieldKind::Integer:
    case FieldKind::Real:
      return number_text(field.get_number(object));
    case FieldKind::Choice:
      return in_quotes(field.choices[static_cast<std::size_t>(field.get_number(object))]);
    case FieldKind::Text:
      return in_quotes(field.text(const_cast<void*>(object)));
    case FieldKind::Numbers: {
      std::string text = "[";
      for (const double number : field.numbers(const_cast<void*>(object))) {
        text.append(text.size() > 1 ? ", " : "").append(number_text(number));
      }
      return text + "]";
    }
    case FieldKind::Texts: {
      std::string text = "[";
      for (const std::string& item : field.texts(const_cast<void*>(object))) {
        text.append(text.size() > 1 ? ", " : "").append(in_quotes(item));
      }
      return text + "]";
    }
  }
  return {};
}

}  // namespace grapnel
