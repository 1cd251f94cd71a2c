#include "base/formats/pcd_header.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>

namespace grapnel {
namespace {

constexpr std::size_t kMaxFields = 256;
constexpr std::uint64_t kMaxCount = 1u << 16;
constexpr std::uint64_t kMaxPoints = 1u << 30;

/// What the header's lines say before they are checked against each other.
struct RawHeader {
  std::vector<std::string_view> fields, sizes, types, counts;
  std::optional<std::uint64_t> width, height, points;
  std::array<double, 7> viewpoint{0, 0, 0, 1, 0, 0, 0};
};

std::vector<std::string_view> words_of(std::string_view rest) {
  std::vector<std::string_view> words;
  std::string_view word;
  while (words.size() <= kMaxFields && take_word(rest, word)) words.push_back(word);
  return words;
}

std::uint64_t count_of(const TextScanner& scanner, std::string_view key, std::string_view rest) {
  std::string_view word;
  std::uint64_t value = 0;
  take_word(rest, word);
  if (!parse_count(word, value) || value > kMaxPoints) {
    throw scanner.problem(std::string(key) + " " + quote_word(word) +
                          " is not allowed; a whole number from 0 to " +
                          std::to_string(kMaxPoints) + " is");
  }
  return value;
}

std::array<double, 7> viewpoint_of(const TextScanner& scanner, std::string_view rest) {
  std::array<double, 7> viewpoint{};
  for (double& value : viewpoint) {
    std::string_view word;
    if (!take_word(rest, word) || !parse_number(word, value) || !std::isfinite(value)) {
      throw scanner.problem("VIEWPOINT needs seven numbers: tx ty tz qw qx qy qz");
    }
  }
  return viewpoint;
}

PcdData data_of(const TextScanner& scanner, std::string_view rest) {
  std::string_view word;
  take_word(rest, word);
  if (word == "ascii") return PcdData::Ascii;
  if (word == "binary") return PcdData::Binary;
  if (word == "binary_compressed") return PcdData::BinaryCompressed;
  throw scanner.problem("DATA " + quote_word(word) +
                        " is not allowed; ascii, binary or binary_compressed is");
}

/// Takes one line other than DATA into `raw`.
void take_line(const TextScanner& scanner, std::string_view key, std::string_view rest,
               RawHeader& raw) {
  if (key == "VERSION") return;
  if (key == "FIELDS" || key == "COLUMNS") {
    raw.fields = words_of(rest);
  } else if (key == "SIZE") {
    raw.sizes = words_of(rest);
  } else if (key == "TYPE") {
    raw.types = words_of(rest);
  } else if (key == "COUNT") {
    raw.counts = words_of(rest);
  } else if (key == "WIDTH") {
    raw.width = count_of(scanner, key, rest);
  } else if (key == "HEIGHT") {
    raw.height = count_of(scanner, key, rest);
  } else if (key == "POINTS") {
    raw.points = count_of(scanner, key, rest);
  } else if (key == "VIEWPOINT") {
    raw.viewpoint = viewpoint_of(scanner, rest);
  } else {
    throw scanner.problem("unknown PCD header entry " + quote_word(key));
  }
}

PcdField field_of(const TextScanner& scanner, const RawHeader& raw, std::size_t i) {
  PcdField field;
  field.name = std::string(raw.fields[i]);
  std::uint64_t size = 0;
  if (!parse_count(raw.sizes[i], size) || (size != 1 && size != 2 && size != 4 && size != 8)) {
    throw scanner.problem("SIZE " + quote_word(raw.sizes[i]) + " of field " +
                          quote_word(field.name) + " is not allowed; 1, 2, 4 or 8 is");
  }
  field.size = static_cast<std::size_t>(size);
  field.type = raw.types[i].front();
  if (raw.types[i].size() != 1 || (field.type != 'F' && field.type != 'I' && field.type != 'U') ||
      (field.type == 'F' && size < 4)) {
    throw scanner.problem("TYPE " + quote_word(raw.types[i]) + " of field " +
                          quote_word(field.name) + " with SIZE " + std::to_string(size) +
                          " is not allowed; I or U with 1, 2, 4 or 8, or F with 4 or 8 is");
  }
  std::uint64_t count = 1;
  if (!raw.counts.empty() && (!parse_count(raw.counts[i], count) || count > kMaxCount)) {
    throw scanner.problem("COUNT " + quote_word(raw.counts[i]) + " of field " +
                          quote_word(field.name) + " is not allowed; 0 to " +
                          std::to_string(kMaxCount) + " is");
  }
  field.count = static_cast<std::size_t>(count);
  return field;
}

void set_grid(const TextScanner& scanner, const RawHeader& raw, PcdHeader& header) {
  if (!raw.width && !raw.points) throw scanner.problem("neither WIDTH nor POINTS is given");
  const std::uint64_t width = raw.width ? *raw.width : *raw.points;
  const std::uint64_t height = raw.height.value_or(1);
  const std::uint64_t points = width * height;
  if (points > kMaxPoints || (raw.points && *raw.points != points)) {
    throw scanner.problem("WIDTH " + std::to_string(width) + " times HEIGHT " +
                          std::to_string(height) +
                          (raw.points ? " is not POINTS " + std::to_string(*raw.points)
                                      : " is more than " + std::to_string(kMaxPoints)));
  }
  header.points = static_cast<std::size_t>(points);
  const bool grid = width > 1 && height > 1;
  header.width = static_cast<int>(grid ? width : points);
  header.height = static_cast<int>(grid ? height : 1);
}

PcdHeader checked(const TextScanner& scanner, const RawHeader& raw) {
  const std::size_t count = raw.fields.size();
  if (count == 0 || count > kMaxFields) {
    throw scanner.problem("FIELDS has " + std::to_string(count) + " names; 1 to " +
                          std::to_string(kMaxFields) + " are allowed");
  }
  if (raw.sizes.size() != count || raw.types.size() != count ||
      (!raw.counts.empty() && raw.counts.size() != count)) {
    throw scanner.problem("FIELDS, SIZE, TYPE and COUNT have different lengths");
  }
  PcdHeader header;
  for (std::size_t i = 0; i < count; ++i) {
    PcdField field = field_of(scanner, raw, i);
    field.offset = header.record_bytes;
    header.record_bytes += field.size * field.count;
    header.fields.push_back(std::move(field));
  }
  set_grid(scanner, raw, header);
  const auto& v = raw.viewpoint;
  header.world_from_sensor.translation() = Vec3d(v[0], v[1], v[2]);
  const Eigen::Quaterniond rotation(v[3], v[4], v[5], v[6]);
  // Some writers leave the rotation all zero; they mean none.
  if (rotation.norm() > 0.0) {
    header.world_from_sensor.linear() = rotation.normalized().toRotationMatrix();
  }
  return header;
}

}  // namespace

PcdHeader read_pcd_header(TextScanner& scanner) {
  RawHeader raw;
  std::string_view line;
  while (scanner.next_line(line)) {
    std::string_view key;
    if (!take_word(line, key) || key.front() == '#') continue;
    if (key == "DATA") {
      PcdHeader header = checked(scanner, raw);
      header.data = data_of(scanner, line);
      return header;
    }
    take_line(scanner, key, line, raw);
  }
  throw scanner.problem("the PCD header ends without a DATA line");
}

}  // namespace grapnel
