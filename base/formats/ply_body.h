#pragma once

#include <cstddef>
#include <span>

#include "base/formats/ply_header.h"

namespace grapnel {

/// Hands out the values after a PLY header one by one, whatever their encoding.
class PlyBody {
 public:
  /// `scanner` stands behind the header of `bytes`; both outlive the body.
  PlyBody(std::span<const std::byte> bytes, PlyData data, TextScanner& scanner) noexcept;

  /// The next value. Throws InputError when the file ends before it or it is no number.
  double next(PlyType type);
  /// The length of a list, as `type`. Throws InputError when it can't fit what is left.
  std::size_t next_count(PlyType type);
  /// "FILE:LINE: TEXT" or "FILE: TEXT at byte N".
  [[nodiscard]] InputError problem(const std::string& text) const;

 private:
  std::span<const std::byte> bytes_;
  PlyData data_;
  TextScanner& scanner_;
  std::size_t at_;
};

}  // namespace grapnel
