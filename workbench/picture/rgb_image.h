#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/image.h"

namespace grapnel {

/// A colour picture in memory.
class RgbImage {
 public:
  RgbImage() = default;
  RgbImage(int width, int height, Rgb8 color);

  [[nodiscard]] int width() const noexcept { return width_; }
  [[nodiscard]] int height() const noexcept { return height_; }
  [[nodiscard]] bool empty() const noexcept { return pixels_.empty(); }
  [[nodiscard]] bool contains(int u, int v) const noexcept {
    return u >= 0 && v >= 0 && u < width_ && v < height_;
  }
  [[nodiscard]] Rgb8& at(int u, int v) noexcept { return pixels_[index(u, v)]; }
  [[nodiscard]] const Rgb8& at(int u, int v) const noexcept { return pixels_[index(u, v)]; }
  [[nodiscard]] const Rgb8* data() const noexcept { return pixels_.data(); }

 private:
  [[nodiscard]] std::size_t index(int u, int v) const noexcept {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(u);
  }

  int width_ = 0;
  int height_ = 0;
  std::vector<Rgb8> pixels_;
};

/// `share` (0…1) of `over` on what is there.
[[nodiscard]] Rgb8 blended(const Rgb8& below, const Rgb8& over, double share) noexcept;

/// Pictures of one height side by side with a gap between.
[[nodiscard]] RgbImage side_by_side(std::span<const RgbImage> images, int gap_px);

/// A PNG file's bytes. Throws InputError.
[[nodiscard]] std::vector<std::byte> png_of(const RgbImage& image);
/// Throws InputError.
void write_png(const std::filesystem::path& file, const RgbImage& image);

/// RFC 4648, section 4, padded.
[[nodiscard]] std::string base64(std::span<const std::byte> bytes);

}  // namespace grapnel
