#include "workbench/import/tiff.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "base/file.h"
#include "base/input_error.h"

namespace grapnel {
namespace {

constexpr std::uint32_t kPlain = 1;
constexpr std::uint32_t kPackBits = 32773;
constexpr std::uint16_t kShort = 3;
constexpr std::uint16_t kLong = 4;

/// Reads numbers in the file's byte order and refuses to read beyond its end.
class TiffBytes {
 public:
  TiffBytes(std::span<const std::byte> bytes, const std::string& name)
      : bytes_(bytes), name_(name) {
    if (bytes.size() < 8) throw problem("is not a TIFF");
    const auto first = std::to_integer<char>(bytes[0]);
    big_endian_ = first == 'M';
    if ((first != 'I' && first != 'M') || bytes[1] != bytes[0] || u16(2) != 42) {
      throw problem("is not a TIFF");
    }
  }
  [[nodiscard]] std::uint32_t u16(std::size_t at) const { return number(at, 2); }
  [[nodiscard]] std::uint32_t u32(std::size_t at) const { return number(at, 4); }
  [[nodiscard]] std::span<const std::byte> part(std::size_t at, std::size_t count) const {
    if (at > bytes_.size() || bytes_.size() - at < count) throw problem("is cut off");
    return bytes_.subspan(at, count);
  }
  [[nodiscard]] bool big_endian() const noexcept { return big_endian_; }
  [[nodiscard]] InputError problem(const std::string& what) const {
    return InputError(name_ + ": " + what);
  }

 private:
  [[nodiscard]] std::uint32_t number(std::size_t at, std::size_t count) const {
    const std::span<const std::byte> digits = part(at, count);
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const std::byte digit = digits[big_endian_ ? i : count - 1 - i];
      value = (value << 8) | std::to_integer<std::uint32_t>(digit);
    }
    return value;
  }

  std::span<const std::byte> bytes_;
  const std::string& name_;
  bool big_endian_ = false;
};

/// The entries of the first directory that are of use.
struct TiffHeader {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t bits = 1;
  std::uint32_t compression = kPlain;
  std::uint32_t channels = 1;
  std::uint32_t planes = 1;
  std::uint32_t rows_per_strip = 0xffffffffu;
  std::vector<std::uint32_t> offsets;
  std::vector<std::uint32_t> sizes;
};

std::vector<std::uint32_t> values_of(const TiffBytes& file, std::size_t entry) {
  const std::uint32_t type = file.u16(entry + 2);
  const std::uint32_t count = file.u32(entry + 4);
  if (type != kShort && type != kLong) return {};
  const std::size_t size = type == kShort ? 2 : 4;
  const std::size_t bytes = std::size_t{count} * size;
  const std::size_t first = bytes <= 4 ? entry + 8 : file.u32(entry + 8);
  (void)file.part(first, bytes);
  std::vector<std::uint32_t> values;
  values.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    values.push_back(type == kShort ? file.u16(first + i * size) : file.u32(first + i * size));
  }
  return values;
}

TiffHeader read_header(const TiffBytes& file) {
  TiffHeader header;
  const std::size_t directory = file.u32(4);
  const std::uint32_t entries = file.u16(directory);
  for (std::uint32_t i = 0; i < entries; ++i) {
    const std::size_t entry = directory + 2 + std::size_t{i} * 12;
    const std::uint32_t tag = file.u16(entry);
    if (tag < 256 || tag > 284) continue;
    const std::vector<std::uint32_t> values = values_of(file, entry);
    if (values.empty()) continue;
    switch (tag) {
      case 256:
        header.width = values[0];
        break;
      case 257:
        header.height = values[0];
        break;
      case 258:
        header.bits = values[0];
        break;
      case 259:
        header.compression = values[0];
        break;
      case 273:
        header.offsets = values;
        break;
      case 277:
        header.channels = values[0];
        break;
      case 278:
        header.rows_per_strip = values[0];
        break;
      case 279:
        header.sizes = values;
        break;
      case 284:
        header.planes = values[0];
        break;
      default:
        break;
    }
  }
  return header;
}

void check(const TiffBytes& file, const TiffHeader& header, std::uint32_t bits,
           std::uint32_t channels) {
  constexpr auto kMaxSide = static_cast<std::uint32_t>(kMaxImageSide_px);
  if (header.width == 0 || header.height == 0 || header.width > kMaxSide ||
      header.height > kMaxSide) {
    throw file.problem(std::to_string(header.width) + " by " + std::to_string(header.height) +
                       " pixels are not allowed; 1 to " + std::to_string(kMaxSide) + " a side are");
  }
  if (header.bits != bits || header.channels != channels || (channels > 1 && header.planes != 1)) {
    throw file.problem("has " + std::to_string(header.channels) + " channels of " +
                       std::to_string(header.bits) + " bits; " + std::to_string(channels) + " of " +
                       std::to_string(bits) + " are expected");
  }
  if (header.compression != kPlain && header.compression != kPackBits) {
    throw file.problem("compression " + std::to_string(header.compression) +
                       " is not supported; 1 (none) and 32773 (PackBits) are");
  }
  if (header.rows_per_strip == 0 || header.offsets.size() != header.sizes.size()) {
    throw file.problem("its strips don't fit together");
  }
}

/// TIFF 6.0, section 9. Answers how much of `out` was filled.
std::size_t unpack_bits(std::span<const std::byte> in, std::span<std::byte> out) noexcept {
  std::size_t at = 0;
  std::size_t made = 0;
  while (at < in.size() && made < out.size()) {
    const int control = static_cast<std::int8_t>(std::to_integer<std::uint8_t>(in[at++]));
    if (control == -128) continue;
    const auto run = static_cast<std::size_t>(control >= 0 ? control + 1 : 1 - control);
    const std::size_t count = std::min(run, out.size() - made);
    if (control >= 0) {
      if (in.size() - at < count) return made;
      std::copy_n(in.data() + at, count, out.data() + made);
      at += run;
    } else {
      if (at >= in.size()) return made;
      std::fill_n(out.data() + made, count, in[at++]);
    }
    made += count;
  }
  return made;
}

void read_strips(const TiffBytes& file, const TiffHeader& header, std::size_t row_bytes,
                 std::span<std::byte> out) {
  std::size_t made = 0;
  for (std::size_t i = 0; i < header.offsets.size() && made < out.size(); ++i) {
    const std::span<const std::byte> strip = file.part(header.offsets[i], header.sizes[i]);
    const std::size_t strip_bytes = std::min<std::size_t>(
        out.size() - made, std::min<std::size_t>(header.rows_per_strip, header.height) * row_bytes);
    std::size_t filled = 0;
    if (header.compression == kPackBits) {
      filled = unpack_bits(strip, out.subspan(made, strip_bytes));
    } else {
      filled = std::min(strip.size(), strip_bytes);
      std::copy_n(strip.data(), filled, out.data() + made);
    }
    if (filled != strip_bytes) throw file.problem("strip " + std::to_string(i) + " is too short");
    made += filled;
  }
  if (made != out.size()) throw file.problem("has too few strips");
}

template <class Image>
Image decode(std::span<const std::byte> bytes, const std::string& name, std::uint32_t bits,
             std::uint32_t channels) {
  const TiffBytes file(bytes, name);
  const TiffHeader header = read_header(file);
  check(file, header, bits, channels);
  Image image;
  image.width = static_cast<int>(header.width);
  image.height = static_cast<int>(header.height);
  image.pixels.resize(std::size_t{header.width} * header.height);
  read_strips(file, header, std::size_t{header.width} * channels * bits / 8,
              std::as_writable_bytes(std::span(image.pixels)));
  return image;
}

}  // namespace

DepthImage decode_depth_tiff(std::span<const std::byte> bytes, const std::string& name) {
  auto image = decode<DepthImage>(bytes, name, 16, 1);
  if (TiffBytes(bytes, name).big_endian()) {
    for (std::uint16_t& count : image.pixels) {
      count = static_cast<std::uint16_t>((count << 8) | (count >> 8));
    }
  }
  return image;
}

ColorImage decode_color_tiff(std::span<const std::byte> bytes, const std::string& name) {
  return decode<ColorImage>(bytes, name, 8, 3);
}

DepthImage read_depth_tiff(const std::filesystem::path& file) {
  return decode_depth_tiff(read_file(file, kMaxImageFileBytes), file.string());
}

ColorImage read_color_tiff(const std::filesystem::path& file) {
  return decode_color_tiff(read_file(file, kMaxImageFileBytes), file.string());
}

}  // namespace grapnel
