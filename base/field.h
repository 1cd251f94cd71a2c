#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace grapnel {

/// What a configuration key holds.
enum class FieldKind : std::uint8_t {
  Bool,
  Integer,
  Real,
  Choice,   ///< one name of a list, an enum class in the struct
  Text,     ///< std::string
  Numbers,  ///< std::vector<double>
  Texts,    ///< std::vector<std::string>
};

/// One configuration key of a parameter struct: its row in the manual, its range check and its
/// place in the struct. A struct's rows are its field table; everything that reads, prints or
/// fuzzes configurations comes from it.
struct Field {
  std::string_view name;
  std::string_view unit;  ///< "m", "rad", "" for counts and names
  std::string_view help;
  FieldKind kind = FieldKind::Real;
  double minimum = 0.0;  ///< numbers only
  double maximum = 0.0;
  std::span<const std::string_view> choices;  ///< Choice only, in the enum's order from 0

  double (*get_number)(const void*) = nullptr;
  void (*set_number)(void*, double) = nullptr;
  std::string& (*text)(void*) = nullptr;
  std::vector<double>& (*numbers)(void*) = nullptr;
  std::vector<std::string>& (*texts)(void*) = nullptr;
};

/// A struct's rows, in the order in which they are shown.
using FieldTable = std::span<const Field>;

namespace field_detail {

template <class T>
struct MemberOf;
template <class Struct, class Value>
struct MemberOf<Value Struct::*> {
  using struct_type = Struct;
  using value_type = Value;
};

template <auto kMember>
using StructOf = typename MemberOf<decltype(kMember)>::struct_type;
template <auto kMember>
using ValueOf = typename MemberOf<decltype(kMember)>::value_type;

template <auto kMember>
double get_number(const void* object) {
  return static_cast<double>(static_cast<const StructOf<kMember>*>(object)->*kMember);
}
template <auto kMember>
void set_number(void* object, double value) {
  static_cast<StructOf<kMember>*>(object)->*kMember = static_cast<ValueOf<kMember>>(value);
}

}  // namespace field_detail

/// A number: integer or floating member, `minimum` and `maximum` included.
template <auto kMember>
[[nodiscard]] constexpr Field number_field(std::string_view name, std::string_view unit,
                                           double minimum, double maximum, std::string_view help) {
  using Value = field_detail::ValueOf<kMember>;
  static_assert(std::is_arithmetic_v<Value> && !std::is_same_v<Value, bool>);
  Field field;
  field.name = name;
  field.unit = unit;
  field.help = help;
  field.kind = std::is_integral_v<Value> ? FieldKind::Integer : FieldKind::Real;
  field.minimum = minimum;
  field.maximum = maximum;
  field.get_number = &field_detail::get_number<kMember>;
  field.set_number = &field_detail::set_number<kMember>;
  return field;
}

template <auto kMember>
[[nodiscard]] constexpr Field bool_field(std::string_view name, std::string_view help) {
  static_assert(std::is_same_v<field_detail::ValueOf<kMember>, bool>);
  Field field;
  field.name = name;
  field.help = help;
  field.kind = FieldKind::Bool;
  field.maximum = 1.0;
  field.get_number = &field_detail::get_number<kMember>;
  field.set_number = &field_detail::set_number<kMember>;
  return field;
}

/// An enum class whose enumerators count from 0 in the order of `choices`.
template <auto kMember>
[[nodiscard]] constexpr Field choice_field(std::string_view name,
                                           std::span<const std::string_view> choices,
                                           std::string_view help) {
  static_assert(std::is_enum_v<field_detail::ValueOf<kMember>>);
  Field field;
  field.name = name;
  field.help = help;
  field.kind = FieldKind::Choice;
  field.choices = choices;
  field.get_number = &field_detail::get_number<kMember>;
  field.set_number = [](void* object, double value) {
    using Value = field_detail::ValueOf<kMember>;
    static_cast<field_detail::StructOf<kMember>*>(object)->*kMember =
        static_cast<Value>(static_cast<std::underlying_type_t<Value>>(value));
  };
  return field;
}

template <auto kMember>
[[nodiscard]] constexpr Field text_field(std::string_view name, std::string_view help) {
  static_assert(std::is_same_v<field_detail::ValueOf<kMember>, std::string>);
  Field field;
  field.name = name;
  field.help = help;
  field.kind = FieldKind::Text;
  field.text = [](void* object) -> std::string& {
    return static_cast<field_detail::StructOf<kMember>*>(object)->*kMember;
  };
  return field;
}

/// A list of numbers, each within `minimum`…`maximum`.
template <auto kMember>
[[nodiscard]] constexpr Field numbers_field(std::string_view name, std::string_view unit,
                                            double minimum, double maximum, std::string_view help) {
  static_assert(std::is_same_v<field_detail::ValueOf<kMember>, std::vector<double>>);
  Field field;
  field.name = name;
  field.unit = unit;
  field.help = help;
  field.kind = FieldKind::Numbers;
  field.minimum = minimum;
  field.maximum = maximum;
  field.numbers = [](void* object) -> std::vector<double>& {
    return static_cast<field_detail::StructOf<kMember>*>(object)->*kMember;
  };
  return field;
}

/// A list of texts.
template <auto kMember>
[[nodiscard]] constexpr Field texts_field(std::string_view name, std::string_view help) {
  static_assert(std::is_same_v<field_detail::ValueOf<kMember>, std::vector<std::string>>);
  Field field;
  field.name = name;
  field.help = help;
  field.kind = FieldKind::Texts;
  field.texts = [](void* object) -> std::vector<std::string>& {
    return static_cast<field_detail::StructOf<kMember>*>(object)->*kMember;
  };
  return field;
}

}  // namespace grapnel
