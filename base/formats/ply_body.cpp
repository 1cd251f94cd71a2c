#include "base/formats/ply_body.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

#include "base/formats/byte_order.h"

namespace grapnel {
namespace {

double decode(const std::byte* at, PlyType type) noexcept {
  switch (type) {
    case PlyType::Int8:
      return load<std::int8_t>(at);
    case PlyType::UInt8:
      return load<std::uint8_t>(at);
    case PlyType::Int16:
      return load<std::int16_t>(at);
    case PlyType::UInt16:
      return load<std::uint16_t>(at);
    case PlyType::Int32:
      return load<std::int32_t>(at);
    case PlyType::UInt32:
      return load<std::uint32_t>(at);
    case PlyType::Float32:
      return static_cast<double>(load<float>(at));
    case PlyType::Float64:
      break;
  }
  return load<double>(at);
}

}  // namespace

PlyBody::PlyBody(std::span<const std::byte> bytes, PlyData data, TextScanner& scanner) noexcept
    : bytes_(bytes), data_(data), scanner_(scanner), at_(scanner.offset()) {}

double PlyBody::next(PlyType type) {
  if (data_ == PlyData::Ascii) {
    std::string_view word;
    double value = 0.0;
    if (!scanner_.next_word(word)) throw problem("the file ends before the last value");
    if (!parse_number(word, value)) throw problem(quote_word(word) + " is not a number");
    return value;
  }
  const std::size_t size = ply_type_bytes(type);
  if (bytes_.size() - at_ < size) throw problem("the file ends before the last value");
  std::array<std::byte, 8> value{};
  std::copy_n(bytes_.data() + at_, size, value.data());
  at_ += size;
  if (data_ == PlyData::BigEndian) std::reverse(value.data(), value.data() + size);
  return decode(value.data(), type);
}

std::size_t PlyBody::next_count(PlyType type) {
  const double count = next(type);
  const std::size_t left = data_ == PlyData::Ascii ? scanner_.remaining() : bytes_.size() - at_;
  if (!(count >= 0.0 && count <= static_cast<double>(left))) {
    throw problem("a list is longer than the file");
  }
  return static_cast<std::size_t>(count);
}

InputError PlyBody::problem(const std::string& text) const {
  if (data_ == PlyData::Ascii) return scanner_.problem(text);
  return scanner_.problem(text + " (byte " + std::to_string(at_) + ")");
}

}  // namespace grapnel
