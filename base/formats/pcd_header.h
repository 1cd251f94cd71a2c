#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/formats/text_scanner.h"
#include "base/geometry.h"

namespace grapnel {

/// One entry of a PCD header's FIELDS.
struct PcdField {
  std::string name;
  std::size_t size = 0;  ///< bytes of one value
  char type = 'F';       ///< F, I or U
  std::size_t count = 1;
  std::size_t offset = 0;  ///< of the first value in a record, bytes
};

enum class PcdData { Ascii, Binary, BinaryCompressed };

/// A PCD header, version 0.5 to 0.7.
struct PcdHeader {
  std::vector<PcdField> fields;
  std::size_t record_bytes = 0;
  std::size_t points = 0;
  int width = 0;
  int height = 1;
  Pose world_from_sensor = Pose::Identity();
  PcdData data = PcdData::Ascii;
};

/// Reads up to and including the DATA line. Throws InputError.
[[nodiscard]] PcdHeader read_pcd_header(TextScanner& scanner);

}  // namespace grapnel
