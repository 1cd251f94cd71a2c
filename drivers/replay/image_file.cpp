#include "drivers/replay/image_file.h"

#include <functional>

#include "base/assert.h"
#include "base/file.h"
#include "base/input_error.h"
#include "drivers/replay/jpeg_codec.h"
#include "drivers/replay/png_codec.h"

namespace grapnel {
namespace {

InputError problem(const std::string& name, const char* what, const char* message) {
  return InputError(name + ": " + what + ": " + message);
}

std::size_t pixel_count(int width, int height) noexcept {
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

/// Answers the pixels to decode into, once the size is known; may refuse it by throwing.
template <class Pixel>
using Destination = std::function<std::span<Pixel>(int width, int height)>;

template <class Pixel>
Destination<Pixel> fixed_size(const std::string& name, int width, int height,
                              std::span<Pixel> out) {
  return [=, &name](int found_width, int found_height) {
    if (found_width == width && found_height == height) return out;
    throw InputError(name + ": " + std::to_string(found_width) + " by " +
                     std::to_string(found_height) + " pixels; " + std::to_string(width) + " by " +
                     std::to_string(height) + " are expected");
  };
}

template <class Image, class Pixel>
Destination<Pixel> sized_by(Image& image) {
  return [&image](int width, int height) {
    image.width = width;
    image.height = height;
    image.pixels.resize(pixel_count(width, height));
    return std::span<Pixel>(image.pixels);
  };
}

void decode_depth(std::span<const std::byte> bytes, const std::string& name,
                  const Destination<std::uint16_t>& destination) {
  PngDecoder decoder(bytes);
  PngInfo info;
  if (!decoder.read_info(info)) throw problem(name, "not a readable PNG", decoder.message());
  if (!info.gray || info.bit_depth != 16) {
    throw InputError(name + ": a depth image is a PNG with one channel of 16 bits; this has " +
                     (info.gray ? "one channel of " : "several channels of ") +
                     std::to_string(info.bit_depth));
  }
  const std::span<std::uint16_t> out = destination(info.width, info.height);
  if (!decoder.read_rows(PngRows::Gray16, std::as_writable_bytes(out))) {
    throw problem(name, "damaged PNG", decoder.message());
  }
}

void decode_png_color(std::span<const std::byte> bytes, const std::string& name,
                      const Destination<Rgb8>& destination) {
  PngDecoder decoder(bytes);
  PngInfo info;
  if (!decoder.read_info(info)) throw problem(name, "not a readable PNG", decoder.message());
  const std::span<Rgb8> out = destination(info.width, info.height);
  if (!decoder.read_rows(PngRows::Rgb8, std::as_writable_bytes(out))) {
    throw problem(name, "damaged PNG", decoder.message());
  }
}

void decode_jpeg(std::span<const std::byte> bytes, const std::string& name,
                 const Destination<Rgb8>& destination) {
  JpegDecoder decoder(bytes);
  int width = 0;
  int height = 0;
  if (!decoder.read_size(width, height)) {
    throw problem(name, "not a readable JPEG", decoder.message());
  }
  if (width > kMaxImageSide_px || height > kMaxImageSide_px) {
    throw InputError(name + ": " + std::to_string(width) + " by " + std::to_string(height) +
                     " pixels; at most " + std::to_string(kMaxImageSide_px) +
                     " a side are allowed");
  }
  if (!decoder.read_rows(std::as_writable_bytes(destination(width, height)))) {
    throw problem(name, "damaged JPEG", decoder.message());
  }
}

void decode_color(std::span<const std::byte> bytes, const std::string& name,
                  const Destination<Rgb8>& destination) {
  const bool jpeg = bytes.size() >= 2 && bytes[0] == std::byte{0xff} && bytes[1] == std::byte{0xd8};
  if (jpeg) {
    decode_jpeg(bytes, name, destination);
  } else {
    decode_png_color(bytes, name, destination);
  }
}

std::vector<std::byte> encoded_png(PngRows rows, int width, int height, const void* first,
                                   std::size_t stride_bytes, PngEffort effort) {
  std::vector<std::byte> out;
  CodecMessage message{};
  if (!encode_png(rows, width, height, static_cast<const std::byte*>(first), stride_bytes, out,
                  message, effort)) {
    throw problem("image", "can't be encoded", message.data());
  }
  return out;
}

}  // namespace

DepthImage decode_depth_png(std::span<const std::byte> bytes, const std::string& name) {
  DepthImage image;
  decode_depth(bytes, name, sized_by<DepthImage, std::uint16_t>(image));
  return image;
}

void decode_depth_png(std::span<const std::byte> bytes, const std::string& name, int width,
                      int height, std::span<std::uint16_t> out) {
  GRAPNEL_ASSERT(out.size() == pixel_count(width, height));
  decode_depth(bytes, name, fixed_size(name, width, height, out));
}

DepthImage read_depth_png(const std::filesystem::path& file) {
  return decode_depth_png(read_file(file, kMaxImageFileBytes), file.string());
}

ColorImage decode_color_image(std::span<const std::byte> bytes, const std::string& name) {
  ColorImage image;
  decode_color(bytes, name, sized_by<ColorImage, Rgb8>(image));
  return image;
}

void decode_color_image(std::span<const std::byte> bytes, const std::string& name, int width,
                        int height, std::span<Rgb8> out) {
  GRAPNEL_ASSERT(out.size() == pixel_count(width, height));
  decode_color(bytes, name, fixed_size(name, width, height, out));
}

ColorImage read_color_image(const std::filesystem::path& file) {
  return decode_color_image(read_file(file, kMaxImageFileBytes), file.string());
}

std::vector<std::byte> encode_depth_png(ImageView<const std::uint16_t> depth, PngEffort effort) {
  return encoded_png(PngRows::Gray16, depth.width, depth.height, depth.data,
                     depth.stride * sizeof(std::uint16_t), effort);
}

std::vector<std::byte> encode_color_png(ImageView<const Rgb8> color, PngEffort effort) {
  static_assert(sizeof(Rgb8) == 3);
  return encoded_png(PngRows::Rgb8, color.width, color.height, color.data,
                     color.stride * sizeof(Rgb8), effort);
}

std::vector<std::byte> encode_color_jpeg(ImageView<const Rgb8> color, int quality) {
  std::vector<std::byte> out;
  CodecMessage message{};
  if (!encode_jpeg(color.width, color.height, reinterpret_cast<const std::byte*>(color.data),
                   color.stride * sizeof(Rgb8), quality, out, message)) {
    throw problem("image", "can't be encoded", message.data());
  }
  return out;
}

void write_depth_png(const std::filesystem::path& file, ImageView<const std::uint16_t> depth) {
  write_file(file, encode_depth_png(depth));
}

void write_color_png(const std::filesystem::path& file, ImageView<const Rgb8> color) {
  write_file(file, encode_color_png(color));
}

}  // namespace grapnel
