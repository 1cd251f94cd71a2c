#include "drivers/replay/image_file.h"

#include <gtest/gtest.h>

#include <csetjmp>
#include <cstdio>
#include <cstdlib>
// jpeglib.h needs FILE declared before it.
#include <jpeglib.h>

#include <algorithm>
#include <string>
#include <vector>

#include "base/input_error.h"
#include "tests/support/temp_folder.h"

namespace grapnel {
namespace {

// Made with zlib from the PNG specification alone (Python): 3×2 pixels of 16-bit grey
// {0, 1, 258, 65535, 1000, 5000}; 2×2 of a palette; 1×2 with alpha.
constexpr unsigned char kDepthPng[] = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52,
    0x00, 0x00, 0x00, 0x03, 0x00, 0x00, 0x00, 0x02, 0x10, 0x00, 0x00, 0x00, 0x00, 0xe8, 0x8f, 0xe5,
    0x85, 0x00, 0x00, 0x00, 0x16, 0x49, 0x44, 0x41, 0x54, 0x78, 0xda, 0x63, 0x60, 0x60, 0x60, 0x60,
    0x64, 0x64, 0x62, 0xf8, 0xff, 0x9f, 0xf9, 0x85, 0x70, 0x07, 0x00, 0x0e, 0x98, 0x03, 0x89, 0x45,
    0xd7, 0x7f, 0xd4, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};

constexpr unsigned char kPalettePng[] = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52,
    0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x02, 0x08, 0x03, 0x00, 0x00, 0x00, 0x45, 0x68, 0xfd,
    0x16, 0x00, 0x00, 0x00, 0x09, 0x50, 0x4c, 0x54, 0x45, 0x0a, 0x14, 0x1e, 0x28, 0x32, 0x3c, 0xff,
    0x00, 0x80, 0x00, 0x9e, 0x27, 0x75, 0x00, 0x00, 0x00, 0x0e, 0x49, 0x44, 0x41, 0x54, 0x78, 0xda,
    0x63, 0x60, 0x60, 0x64, 0x60, 0x62, 0x00, 0x00, 0x00, 0x0e, 0x00, 0x04, 0xdb, 0xe0, 0x32, 0x8e,
    0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};

constexpr unsigned char kAlphaPng[] = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44,
    0x52, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x02, 0x08, 0x06, 0x00, 0x00, 0x00, 0x99,
    0x81, 0xb6, 0x27, 0x00, 0x00, 0x00, 0x12, 0x49, 0x44, 0x41, 0x54, 0x78, 0xda, 0x63, 0x60,
    0x64, 0x62, 0x66, 0x60, 0xf8, 0xf5, 0xfb, 0xcf, 0x7f, 0x00, 0x0a, 0x08, 0x03, 0xf7, 0x3b,
    0x75, 0xd1, 0x52, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82};

std::span<const std::byte> bytes_of(std::span<const unsigned char> bytes) {
  return std::as_bytes(bytes);
}

std::vector<std::byte> jpeg_of_one_color(int side, const Rgb8& color, J_COLOR_SPACE space) {
  jpeg_compress_struct encoder{};
  jpeg_error_mgr errors{};
  encoder.err = jpeg_std_error(&errors);
  jpeg_create_compress(&encoder);
  unsigned char* data = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&encoder, &data, &size);
  encoder.image_width = encoder.image_height = static_cast<JDIMENSION>(side);
  encoder.input_components = space == JCS_RGB ? 3 : 1;
  encoder.in_color_space = space;
  jpeg_set_defaults(&encoder);
  jpeg_set_quality(&encoder, 100, TRUE);
  jpeg_start_compress(&encoder, TRUE);
  std::vector<unsigned char> row;
  for (int u = 0; u < side; ++u) {
    row.push_back(color.r);
    if (space != JCS_RGB) continue;
    row.push_back(color.g);
    row.push_back(color.b);
  }
  JSAMPROW rows[] = {row.data()};
  for (int v = 0; v < side; ++v) jpeg_write_scanlines(&encoder, rows, 1);
  jpeg_finish_compress(&encoder);
  jpeg_destroy_compress(&encoder);
  const auto* const first = reinterpret_cast<const std::byte*>(data);
  std::vector<std::byte> bytes(first, first + size);
  std::free(data);
  return bytes;
}

TEST(ImageFile, DecodesSixteenBitGreyAsItsCounts) {
  const DepthImage image = decode_depth_png(bytes_of(kDepthPng), "a.png");
  EXPECT_EQ(image.width, 3);
  EXPECT_EQ(image.height, 2);
  EXPECT_EQ(image.pixels, (std::vector<std::uint16_t>{0, 1, 258, 65535, 1000, 5000}));
}

TEST(ImageFile, DecodesPaletteAndAlphaAsPlainColour) {
  const ColorImage palette = decode_color_image(bytes_of(kPalettePng), "p.png");
  EXPECT_EQ(palette.pixels,
            (std::vector<Rgb8>{{10, 20, 30}, {40, 50, 60}, {255, 0, 128}, {10, 20, 30}}));
  const ColorImage alpha = decode_color_image(bytes_of(kAlphaPng), "a.png");
  EXPECT_EQ(alpha.pixels, (std::vector<Rgb8>{{1, 2, 3}, {250, 251, 252}}));
}

TEST(ImageFile, RefusesColourAsDepthAndSaysWhatItIs) {
  try {
    (void)decode_depth_png(bytes_of(kPalettePng), "p.png");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("p.png: a depth image is"), std::string::npos);
  }
}

TEST(ImageFile, RefusesAnotherSizeThanExpected) {
  std::vector<std::uint16_t> out(4);
  try {
    decode_depth_png(bytes_of(kDepthPng), "a.png", 2, 2, out);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "a.png: 3 by 2 pixels; 2 by 2 are expected");
  }
}

TEST(ImageFile, RefusesAPngCutAtAnyByte) {
  for (std::size_t size = 0; size < sizeof kDepthPng; ++size) {
    EXPECT_THROW((void)decode_depth_png(bytes_of(kDepthPng).first(size), "cut"), InputError)
        << size;
  }
}

TEST(ImageFile, RefusesAPngWithAnyByteOfItsPixelsChanged) {
  std::vector<unsigned char> damaged(std::begin(kDepthPng), std::end(kDepthPng));
  const std::string_view text(reinterpret_cast<const char*>(damaged.data()), damaged.size());
  const std::size_t begin = text.find("IDAT");
  const std::size_t end = text.find("IEND") - 4;
  for (std::size_t i = begin; i < end; ++i) {
    damaged[i] = static_cast<unsigned char>(damaged[i] ^ 0x10);
    EXPECT_THROW((void)decode_depth_png(bytes_of(damaged), "damaged"), InputError) << i;
    damaged[i] = static_cast<unsigned char>(damaged[i] ^ 0x10);
  }
}

TEST(ImageFile, DecodesJpegInColourAndInGrey) {
  const ColorImage color =
      decode_color_image(jpeg_of_one_color(16, {200, 100, 50}, JCS_RGB), "c.jpg");
  ASSERT_EQ(color.pixels.size(), 256u);
  // YCbCr at quality 100 keeps a flat colour within 2 counts.
  EXPECT_NEAR(color.pixels[100].r, 200, 2);
  EXPECT_NEAR(color.pixels[100].g, 100, 2);
  EXPECT_NEAR(color.pixels[100].b, 50, 2);
  const ColorImage gray =
      decode_color_image(jpeg_of_one_color(16, {90, 0, 0}, JCS_GRAYSCALE), "g.jpg");
  EXPECT_NEAR(gray.pixels[100].g, 90, 2);
}

TEST(ImageFile, RefusesAJpegCutBeforeItsEndMarker) {
  const std::vector<std::byte> whole = jpeg_of_one_color(24, {1, 200, 30}, JCS_RGB);
  for (std::size_t size = 0; size + 2 <= whole.size(); ++size) {
    EXPECT_THROW((void)decode_color_image(std::span(whole).first(size), "cut"), InputError) << size;
  }
}

TEST(ImageFile, WrittenDepthIsTheSameReadBackAlsoFromAStridedView) {
  const test::TempFolder folder;
  std::vector<std::uint16_t> pixels(10 * 4);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    pixels[i] = static_cast<std::uint16_t>(i * 1637);
  }
  write_depth_png(folder / "d.png", {pixels.data() + 2, 7, 4, 10});
  const DepthImage read = read_depth_png(folder / "d.png");
  ASSERT_EQ(read.width, 7);
  ASSERT_EQ(read.height, 4);
  for (std::size_t v = 0; v < 4; ++v) {
    for (std::size_t u = 0; u < 7; ++u) {
      EXPECT_EQ(read.pixels[v * 7 + u], pixels[v * 10 + u + 2]);
    }
  }
}

TEST(ImageFile, WrittenColourIsTheSameReadBack) {
  const test::TempFolder folder;
  std::vector<Rgb8> pixels;
  for (int i = 0; i < 30; ++i) {
    pixels.push_back({static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(255 - i),
                      static_cast<std::uint8_t>(i * 7)});
  }
  write_color_png(folder / "c.png", {pixels.data(), 6, 5});
  EXPECT_EQ(read_color_image(folder / "c.png").pixels, pixels);
}

TEST(ImageFile, SaysWhichFileIsNotThere) {
  try {
    (void)read_depth_png("no/such.png");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "no/such.png: can't be opened: No such file or directory");
  }
}

}  // namespace
}  // namespace grapnel
