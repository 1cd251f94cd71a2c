#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/formats/text_scanner.h"

namespace grapnel {

enum class PlyType : std::uint8_t { Int8, UInt8, Int16, UInt16, Int32, UInt32, Float32, Float64 };

[[nodiscard]] std::size_t ply_type_bytes(PlyType type) noexcept;
[[nodiscard]] inline bool ply_type_is_real(PlyType type) noexcept {
  return type == PlyType::Float32 || type == PlyType::Float64;
}

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::Float32;  ///< of the value, or of a list's items
  bool is_list = false;
  PlyType count_type = PlyType::UInt8;  ///< lists only
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

enum class PlyData : std::uint8_t { Ascii, LittleEndian, BigEndian };

struct PlyHeader {
  PlyData data = PlyData::Ascii;
  std::vector<PlyElement> elements;
};

/// Reads up to and including end_header. Every element's rows fit what follows in the file. Throws
/// InputError.
[[nodiscard]] PlyHeader read_ply_header(TextScanner& scanner);

}  // namespace grapnel
