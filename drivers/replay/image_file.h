#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/image.h"
#include "drivers/replay/png_codec.h"

namespace grapnel {

/// Largest encoded image that is read, and largest side of one.
inline constexpr std::uintmax_t kMaxImageFileBytes = std::uintmax_t{1} << 28;
inline constexpr int kMaxImageSide_px = 8192;

/// Depth counts, rows packed.
struct DepthImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint16_t> pixels;

  [[nodiscard]] ImageView<const std::uint16_t> view() const noexcept {
    return {pixels.data(), width, height};
  }
};

/// Colours, rows packed.
struct ColorImage {
  int width = 0;
  int height = 0;
  std::vector<Rgb8> pixels;

  [[nodiscard]] ImageView<const Rgb8> view() const noexcept {
    return {pixels.data(), width, height};
  }
};

/// A 16-bit grey PNG. Throws InputError: not such a PNG, damaged, or cut off.
[[nodiscard]] DepthImage read_depth_png(const std::filesystem::path& file);
[[nodiscard]] DepthImage decode_depth_png(std::span<const std::byte> bytes,
                                          const std::string& name);

/// A PNG of any kind or a JPEG as 8-bit RGB. Throws InputError.
[[nodiscard]] ColorImage read_color_image(const std::filesystem::path& file);
[[nodiscard]] ColorImage decode_color_image(std::span<const std::byte> bytes,
                                            const std::string& name);

/// The same into the caller's buffer of width × height pixels. Throw InputError also when the image
/// has another size.
void decode_depth_png(std::span<const std::byte> bytes, const std::string& name, int width,
                      int height, std::span<std::uint16_t> out);
void decode_color_image(std::span<const std::byte> bytes, const std::string& name, int width,
                        int height, std::span<Rgb8> out);

/// PNG at compression level 1. The file appears whole or not at all. Throw InputError.
void write_depth_png(const std::filesystem::path& file, ImageView<const std::uint16_t> depth);
void write_color_png(const std::filesystem::path& file, ImageView<const Rgb8> color);

/// The same without a file. Throw InputError.
[[nodiscard]] std::vector<std::byte> encode_depth_png(ImageView<const std::uint16_t> depth,
                                                      PngEffort effort = PngEffort::Small);
[[nodiscard]] std::vector<std::byte> encode_color_png(ImageView<const Rgb8> color,
                                                      PngEffort effort = PngEffort::Small);
/// Quality 1…100; colours at full resolution.
[[nodiscard]] std::vector<std::byte> encode_color_jpeg(ImageView<const Rgb8> color, int quality);

}  // namespace grapnel
