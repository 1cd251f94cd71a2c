#include "workbench/picture/rgb_image.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "base/file.h"
#include "base/input_error.h"
#include "drivers/replay/png_codec.h"

namespace grapnel {

static_assert(sizeof(Rgb8) == 3, "rows are handed to the encoder as they lie");

RgbImage::RgbImage(int width, int height, Rgb8 color)
    : width_(width),
      height_(height),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), color) {}

Rgb8 blended(const Rgb8& below, const Rgb8& over, double share) noexcept {
  const auto mix = [share](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::lround(a + share * (b - a)));
  };
  return {mix(below.r, over.r), mix(below.g, over.g), mix(below.b, over.b)};
}

RgbImage side_by_side(std::span<const RgbImage> images, int gap_px) {
  int width = 0;
  int height = 0;
  for (const RgbImage& image : images) {
    width += image.width() + (width > 0 ? gap_px : 0);
    height = std::max(height, image.height());
  }
  RgbImage joined(width, height, {255, 255, 255});
  int left = 0;
  for (const RgbImage& image : images) {
    for (int v = 0; v < image.height(); ++v) {
      for (int u = 0; u < image.width(); ++u) joined.at(left + u, v) = image.at(u, v);
    }
    left += image.width() + gap_px;
  }
  return joined;
}

std::vector<std::byte> png_of(const RgbImage& image) {
  std::vector<std::byte> bytes;
  CodecMessage message{};
  const auto stride = static_cast<std::size_t>(image.width()) * sizeof(Rgb8);
  if (!encode_png(PngRows::Rgb8, image.width(), image.height(),
                  std::as_bytes(std::span(image.data(), 1)).data(), stride, bytes, message,
                  PngEffort::Small)) {
    throw InputError("a picture can't be made: " + std::string(message.data()));
  }
  return bytes;
}

void write_png(const std::filesystem::path& file, const RgbImage& image) {
  write_file(file, std::span<const std::byte>(png_of(image)));
}

std::string base64(std::span<const std::byte> bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = group << 8U | (k < left ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= left ? kDigits[group >> (18U - 6U * k) & 63U] : '=';
    }
  }
  return text;
}

}  // namespace grapnel
