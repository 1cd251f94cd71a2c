#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string_view>
#include <type_traits>

#include "base/cloud_file.h"
#include "base/formats/byte_order.h"
#include "base/formats/lzf.h"
#include "base/formats/pcd_header.h"
#include "base/formats/text_scanner.h"

namespace grapnel {
namespace {

/// Where the values of one field lie: point i's at first + i × stride.
struct Column {
  const std::byte* first = nullptr;
  std::size_t stride = 0;
  std::size_t size = 0;
  char type = 'F';
};

double value_at(const Column& column, std::size_t i) noexcept {
  const std::byte* const at = column.first + i * column.stride;
  if (column.type == 'F') {
    return column.size == 4 ? static_cast<double>(load<float>(at)) : load<double>(at);
  }
  const bool is_signed = column.type == 'I';
  switch (column.size) {
    case 1:
      return is_signed ? load<std::int8_t>(at) : load<std::uint8_t>(at);
    case 2:
      return is_signed ? load<std::int16_t>(at) : load<std::uint16_t>(at);
    case 4:
      return is_signed ? load<std::int32_t>(at) : load<std::uint32_t>(at);
    default:
      return is_signed ? static_cast<double>(load<std::int64_t>(at))
                       : static_cast<double>(load<std::uint64_t>(at));
  }
}

/// The points' bytes, and how a field's values lie in them.
class PcdBody {
 public:
  PcdBody(const PcdHeader& header, const std::byte* data, bool by_field)
      : header_(header), data_(data), by_field_(by_field) {}

  [[nodiscard]] bool has(std::string_view name) const noexcept { return find(name) != nullptr; }
  [[nodiscard]] Column column(std::string_view name) const noexcept {
    const PcdField& field = *find(name);
    if (by_field_) {
      return {data_ + field.offset * header_.points, field.size * field.count, field.size,
              field.type};
    }
    return {data_ + field.offset, header_.record_bytes, field.size, field.type};
  }
  [[nodiscard]] std::vector<float> floats(std::string_view name) const {
    const Column source = column(name);
    std::vector<float> values(header_.points);
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] = static_cast<float>(value_at(source, i));
    }
    return values;
  }

 private:
  [[nodiscard]] const PcdField* find(std::string_view name) const noexcept {
    for (const PcdField& field : header_.fields) {
      if (field.name == name && field.count == 1) return &field;
    }
    return nullptr;
  }

  const PcdHeader& header_;
  const std::byte* data_;
  bool by_field_;
};

/// Colours packed as 0xAARRGGBB, in an integer or in the bits of a float.
std::vector<Rgb8> unpack_colors(const Column& source, std::size_t points) {
  std::vector<Rgb8> colors(points);
  for (std::size_t i = 0; i < points; ++i) {
    const auto packed = load<std::uint32_t>(source.first + i * source.stride);
    colors[i] = {static_cast<std::uint8_t>(packed >> 16), static_cast<std::uint8_t>(packed >> 8),
                 static_cast<std::uint8_t>(packed)};
  }
  return colors;
}

/// The nearest T, so that numbers outside its range and NaN are defined.
template <class T>
T limited(double value) noexcept {
  if constexpr (std::is_integral_v<T>) {
    if (!(value > static_cast<double>(std::numeric_limits<T>::min()))) {
      return std::numeric_limits<T>::min();
    }
    if (value >= static_cast<double>(std::numeric_limits<T>::max())) {
      return std::numeric_limits<T>::max();
    }
  }
  return static_cast<T>(value);
}

template <class T>
void store(std::byte* at, double value) noexcept {
  const T converted = limited<T>(value);
  std::memcpy(at, &converted, sizeof converted);
}

void store_number(const PcdField& field, std::byte* at, double value) noexcept {
  if (field.type == 'F')
    return field.size == 4 ? store<float>(at, value) : store<double>(at, value);
  const bool is_signed = field.type == 'I';
  switch (field.size) {
    case 1:
      return is_signed ? store<std::int8_t>(at, value) : store<std::uint8_t>(at, value);
    case 2:
      return is_signed ? store<std::int16_t>(at, value) : store<std::uint16_t>(at, value);
    case 4:
      return is_signed ? store<std::int32_t>(at, value) : store<std::uint32_t>(at, value);
    default:
      return is_signed ? store<std::int64_t>(at, value) : store<std::uint64_t>(at, value);
  }
}

/// One line of an ascii body into one binary record.
void read_record(const TextScanner& scanner, const PcdHeader& header, std::string_view line,
                 std::byte* record) {
  for (const PcdField& field : header.fields) {
    for (std::size_t k = 0; k < field.count; ++k) {
      std::string_view word;
      if (!take_word(line, word)) {
        throw scanner.problem("the point's line ends before its field " + quote_word(field.name));
      }
      double value = 0.0;
      if (!parse_number(word, value)) {
        throw scanner.problem(quote_word(word) + " in field " + quote_word(field.name) +
                              " is not a number");
      }
      store_number(field, record + field.offset + k * field.size, value);
    }
  }
}

std::vector<std::byte> read_ascii(TextScanner& scanner, const PcdHeader& header) {
  std::size_t values = 0;
  for (const PcdField& field : header.fields) values += field.count;
  // Each value takes a digit and a blank or line end, the last one's end may be missing.
  if (header.points * std::max<std::size_t>(values, 1) * 2 > scanner.remaining() + 1) {
    throw scanner.problem(std::to_string(header.points) + " points of " + std::to_string(values) +
                          " values are declared, but only " + std::to_string(scanner.remaining()) +
                          " bytes follow");
  }
  std::vector<std::byte> records(header.points * header.record_bytes);
  std::size_t point = 0;
  std::string_view line;
  while (point < header.points && scanner.next_line(line)) {
    if (line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    read_record(scanner, header, line, records.data() + point * header.record_bytes);
    ++point;
  }
  if (point < header.points) {
    throw scanner.problem(std::to_string(header.points) + " points are declared, but only " +
                          std::to_string(point) + " are there");
  }
  return records;
}

std::vector<std::byte> decompress(const TextScanner& scanner, const PcdHeader& header,
                                  std::span<const std::byte> body) {
  if (body.size() < 8) throw scanner.problem("the compressed data's sizes are cut off");
  const std::size_t packed = load<std::uint32_t>(body.data());
  const std::size_t unpacked = load<std::uint32_t>(body.data() + 4);
  const std::size_t needed = header.points * header.record_bytes;
  if (unpacked != needed) {
    throw scanner.problem("the compressed data holds " + std::to_string(unpacked) +
                          " bytes; the header's points need " + std::to_string(needed));
  }
  if (packed > body.size() - 8) {
    throw scanner.problem("the compressed data is cut off: " + std::to_string(body.size() - 8) +
                          " of " + std::to_string(packed) + " bytes are there");
  }
  std::vector<std::byte> out;
  if (unpacked <= packed * kMaxLzfRatio) out.resize(unpacked);
  if (out.size() != unpacked || !lzf_decompress(body.subspan(8, packed), out)) {
    throw scanner.problem("the compressed data is damaged");
  }
  return out;
}

/// Makes every point without a complete reading NaN in all three coordinates.
void mark_unread(CloudData& cloud) noexcept {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = 0; i < cloud.x.size(); ++i) {
    if (std::isfinite(cloud.x[i]) && std::isfinite(cloud.y[i]) && std::isfinite(cloud.z[i]))
      continue;
    cloud.x[i] = cloud.y[i] = cloud.z[i] = kNone;
  }
}

CloudData gather(const TextScanner& scanner, const PcdHeader& header, const PcdBody& body) {
  for (const std::string_view name : {"x", "y", "z"}) {
    if (!body.has(name)) throw scanner.problem("there is no field " + quote_word(name));
  }
  CloudData cloud;
  cloud.width = header.width;
  cloud.height = header.height;
  cloud.world_from_sensor = header.world_from_sensor;
  cloud.x = body.floats("x");
  cloud.y = body.floats("y");
  cloud.z = body.floats("z");
  if (body.has("normal_x") && body.has("normal_y") && body.has("normal_z")) {
    cloud.nx = body.floats("normal_x");
    cloud.ny = body.floats("normal_y");
    cloud.nz = body.floats("normal_z");
  }
  if (body.has("curvature")) cloud.curvature = body.floats("curvature");
  if (body.has("intensity")) cloud.intensity = body.floats("intensity");
  for (const std::string_view name : {"rgb", "rgba"}) {
    if (!body.has(name) || body.column(name).size != 4) continue;
    cloud.color = unpack_colors(body.column(name), header.points);
  }
  if (body.has("label")) {
    const Column source = body.column("label");
    cloud.label.resize(header.points);
    for (std::size_t i = 0; i < header.points; ++i) {
      cloud.label[i] = limited<std::uint32_t>(value_at(source, i));
    }
  }
  mark_unread(cloud);
  return cloud;
}

}  // namespace

CloudData parse_pcd(std::span<const std::byte> bytes, const std::string& name) {
  TextScanner scanner({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, name);
  const PcdHeader header = read_pcd_header(scanner);
  if (header.data == PcdData::Ascii) {
    const std::vector<std::byte> records = read_ascii(scanner, header);
    return gather(scanner, header, PcdBody(header, records.data(), false));
  }
  const std::span<const std::byte> body = bytes.subspan(scanner.offset());
  if (header.data == PcdData::BinaryCompressed) {
    const std::vector<std::byte> columns = decompress(scanner, header, body);
    return gather(scanner, header, PcdBody(header, columns.data(), true));
  }
  const std::size_t needed = header.points * header.record_bytes;
  if (body.size() < needed) {
    throw scanner.problem("the data is cut off: " + std::to_string(body.size()) + " of " +
                          std::to_string(needed) + " bytes are there");
  }
  return gather(scanner, header, PcdBody(header, body.data(), false));
}

}  // namespace grapnel
