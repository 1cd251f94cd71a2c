#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "drivers/replay/png_codec.h"

namespace grapnel {

/// One decoding of a JPEG in memory as 8-bit RGB: libjpeg reports errors by a call that must not
/// return, which stays inside here. What libjpeg only warns of (a cut or damaged file) is an error.
class JpegDecoder {
 public:
  explicit JpegDecoder(std::span<const std::byte> bytes);
  JpegDecoder(const JpegDecoder&) = delete;
  JpegDecoder& operator=(const JpegDecoder&) = delete;
  ~JpegDecoder();

  /// First: the size. False with message().
  [[nodiscard]] bool read_size(int& width, int& height) noexcept;
  /// Then: fills height rows of width × 3 bytes.
  [[nodiscard]] bool read_rows(std::span<std::byte> out) noexcept;
  [[nodiscard]] const char* message() const noexcept;

 private:
  struct State;
  State* state_;
};

/// Encodes rows of 8-bit RGB, colours at full resolution; `stride_bytes` from row to row, quality
/// 1…100. False with `message`.
[[nodiscard]] bool encode_jpeg(int width, int height, const std::byte* first,
                               std::size_t stride_bytes, int quality, std::vector<std::byte>& out,
                               CodecMessage& message);

}  // namespace grapnel
