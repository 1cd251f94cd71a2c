#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace grapnel {

/// What libpng said of a failure, one line.
using CodecMessage = std::array<char, 160>;

/// What a PNG's header says, before anything is decoded.
struct PngInfo {
  int width = 0;
  int height = 0;
  int bit_depth = 0;
  bool gray = false;  ///< one channel, no palette, no alpha
};

/// How the rows come out: 16-bit grey as the machine holds it, or 8-bit RGB.
enum class PngRows : std::uint8_t { Gray16, Rgb8 };

/// One decoding of a PNG in memory: libpng reports errors by longjmp, which stays inside here.
class PngDecoder {
 public:
  explicit PngDecoder(std::span<const std::byte> bytes);
  PngDecoder(const PngDecoder&) = delete;
  PngDecoder& operator=(const PngDecoder&) = delete;
  ~PngDecoder();

  /// First: false with message().
  [[nodiscard]] bool read_info(PngInfo& info) noexcept;
  /// Then: fills height rows of width × 2 or × 3 bytes, and reads to the end so that a file cut
  /// anywhere fails. Gray16 only for a 16-bit grey image.
  [[nodiscard]] bool read_rows(PngRows rows, std::span<std::byte> out) noexcept;
  [[nodiscard]] const char* message() const noexcept;

 private:
  struct State;
  State* state_;
};

/// What an encoder spends to make an image small.
enum class PngEffort : std::uint8_t {
  None,   ///< as it is, under a millisecond for 640×480
  Fast,   ///< neighbours' differences and Huffman codes: a third to a half of level 1's time
  Small,  ///< level 1
};

/// Encodes rows of 16-bit grey or 8-bit RGB; `stride_bytes` from row to row. False with `message`.
[[nodiscard]] bool encode_png(PngRows rows, int width, int height, const std::byte* first,
                              std::size_t stride_bytes, std::vector<std::byte>& out,
                              CodecMessage& message, PngEffort effort = PngEffort::Small);

}  // namespace grapnel
