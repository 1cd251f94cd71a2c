#include "base/formats/ply_header.h"

#include <array>
#include <string_view>
#include <utility>

namespace grapnel {
namespace {

constexpr std::size_t kMaxElements = 32;
constexpr std::size_t kMaxProperties = 256;

PlyType type_of(const TextScanner& scanner, std::string_view word) {
  static constexpr std::array<std::pair<std::string_view, PlyType>, 16> kNames = {{
      {"char", PlyType::Int8},
      {"int8", PlyType::Int8},
      {"uchar", PlyType::UInt8},
      {"uint8", PlyType::UInt8},
      {"short", PlyType::Int16},
      {"int16", PlyType::Int16},
      {"ushort", PlyType::UInt16},
      {"uint16", PlyType::UInt16},
      {"int", PlyType::Int32},
      {"int32", PlyType::Int32},
      {"uint", PlyType::UInt32},
      {"uint32", PlyType::UInt32},
      {"float", PlyType::Float32},
      {"float32", PlyType::Float32},
      {"double", PlyType::Float64},
      {"float64", PlyType::Float64},
  }};
  for (const auto& [name, type] : kNames) {
    if (name == word) return type;
  }
  throw scanner.problem(quote_word(word) +
                        " is not a PLY type; char, uchar, short, ushort, int, uint, float or "
                        "double is");
}

PlyData format_of(const TextScanner& scanner, std::string_view rest) {
  std::string_view word;
  take_word(rest, word);
  if (word == "ascii") return PlyData::Ascii;
  if (word == "binary_little_endian") return PlyData::LittleEndian;
  if (word == "binary_big_endian") return PlyData::BigEndian;
  throw scanner.problem("format " + quote_word(word) +
                        " is not allowed; ascii, binary_little_endian or binary_big_endian is");
}

PlyElement element_of(const TextScanner& scanner, std::string_view rest) {
  std::string_view name;
  std::string_view count_word;
  std::uint64_t count = 0;
  take_word(rest, name);
  take_word(rest, count_word);
  // An index into an element has 32 bits.
  if (name.empty() || !parse_count(count_word, count) || count > 0xffffffffu) {
    throw scanner.problem("element needs a name and a count of at most 4294967295");
  }
  return {std::string(name), static_cast<std::size_t>(count), {}};
}

PlyProperty property_of(const TextScanner& scanner, std::string_view rest) {
  PlyProperty property;
  std::string_view word;
  take_word(rest, word);
  if (word == "list") {
    property.is_list = true;
    take_word(rest, word);
    property.count_type = type_of(scanner, word);
    if (ply_type_is_real(property.count_type)) {
      throw scanner.problem("a list's count is a whole number, not " + quote_word(word));
    }
    take_word(rest, word);
  }
  property.type = type_of(scanner, word);
  if (!take_word(rest, word)) throw scanner.problem("the property has no name");
  property.name = std::string(word);
  return property;
}

/// Fewest bytes that one row of `element` takes.
std::size_t min_row_bytes(const PlyElement& element, PlyData data) noexcept {
  if (data == PlyData::Ascii) return 2 * element.properties.size();
  std::size_t bytes = 0;
  for (const PlyProperty& property : element.properties) {
    bytes += ply_type_bytes(property.is_list ? property.count_type : property.type);
  }
  return bytes;
}

void check_counts(const TextScanner& scanner, const PlyHeader& header) {
  // The last line of a text may lack its end.
  std::size_t room = scanner.remaining() + (header.data == PlyData::Ascii ? 1 : 0);
  for (const PlyElement& element : header.elements) {
    if (element.count == 0) continue;
    const std::size_t row_bytes = min_row_bytes(element, header.data);
    if (row_bytes == 0) {
      throw scanner.problem("element " + quote_word(element.name) + " has no property");
    }
    if (element.count > room / row_bytes) {
      throw scanner.problem("element " + quote_word(element.name) + " declares " +
                            std::to_string(element.count) + " rows; only " +
                            std::to_string(scanner.remaining()) + " bytes follow the header");
    }
    room -= element.count * row_bytes;
  }
}

}  // namespace

std::size_t ply_type_bytes(PlyType type) noexcept {
  static constexpr std::array<std::size_t, 8> kBytes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kBytes[static_cast<std::size_t>(type)];
}

PlyHeader read_ply_header(TextScanner& scanner) {
  PlyHeader header;
  bool format_seen = false;
  std::string_view line;
  if (!scanner.next_line(line) || line != "ply") {
    throw scanner.problem("a PLY file begins with the line \"ply\"");
  }
  while (scanner.next_line(line)) {
    std::string_view key;
    if (!take_word(line, key) || key == "comment" || key == "obj_info") continue;
    if (key == "end_header") {
      if (!format_seen) throw scanner.problem("the PLY header has no format line");
      check_counts(scanner, header);
      return header;
    }
    if (key == "format") {
      header.data = format_of(scanner, line);
      format_seen = true;
    } else if (key == "element" && header.elements.size() < kMaxElements) {
      header.elements.push_back(element_of(scanner, line));
    } else if (key == "property" && !header.elements.empty() &&
               header.elements.back().properties.size() < kMaxProperties) {
      header.elements.back().properties.push_back(property_of(scanner, line));
    } else {
      throw scanner.problem("unexpected PLY header entry " + quote_word(key));
    }
  }
  throw scanner.problem("the PLY header ends without end_header");
}

}  // namespace grapnel
