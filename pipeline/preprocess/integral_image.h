#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"

namespace grapnel {

/// A rectangle of pixels: columns [u, u + width), rows [v, v + height).
struct PixelWindow {
  int u = 0;
  int v = 0;
  int width = 0;
  int height = 0;
};

/// Sums of several channels over any rectangle of an image in time that does not depend on its size
/// (Crow 1984; Viola and Jones 2001). Pixels without a value are left out and not counted. In
/// double.
class IntegralImage {
 public:
  void reserve(Arena& arena, std::size_t channels, std::size_t max_pixels, std::size_t max_edge);

  /// Whether an image of this size fits.
  [[nodiscard]] bool fits(int width, int height) const noexcept;
  /// Sums of `width` × `height` pixels: `value_of(u, v, values)` fills one pixel's channels, or
  /// returns false where it has none. O(pixels).
  template <class ValueOf>
  void fill(int width, int height, const ValueOf& value_of) noexcept;

  /// Of a rectangle inside the image.
  [[nodiscard]] double sum(std::size_t channel, const PixelWindow& window) const noexcept {
    const double* const sums = sums_.data() + channel * plane_;
    const Corners at = corners(window);
    return sums[at.end] + sums[at.begin] - sums[at.right] - sums[at.below];
  }
  /// Pixels of the rectangle that have a value.
  [[nodiscard]] std::int32_t count(const PixelWindow& window) const noexcept {
    const Corners at = corners(window);
    return counts_[at.end] + counts_[at.begin] - counts_[at.right] - counts_[at.below];
  }

 private:
  static constexpr std::size_t kMaxChannels = 9;
  struct Corners {
    std::size_t begin, right, below, end;
  };
  [[nodiscard]] Corners corners(const PixelWindow& window) const noexcept {
    const auto begin =
        static_cast<std::size_t>(window.v) * stride_ + static_cast<std::size_t>(window.u);
    const std::size_t below = begin + static_cast<std::size_t>(window.height) * stride_;
    const auto width = static_cast<std::size_t>(window.width);
    return {begin, begin + width, below, below + width};
  }

  std::size_t channels_ = 0;
  std::size_t plane_ = 0;   ///< room of one channel
  std::size_t stride_ = 0;  ///< columns of the image and one
  std::span<double> sums_;  ///< channel by channel, of all pixels above and left
  std::span<std::int32_t> counts_;
};

template <class ValueOf>
void IntegralImage::fill(int width, int height, const ValueOf& value_of) noexcept {
  stride_ = static_cast<std::size_t>(width) + 1;
  for (std::size_t u = 0; u < stride_; ++u) {
    counts_[u] = 0;
    for (std::size_t c = 0; c < channels_; ++c) sums_[c * plane_ + u] = 0.0;
  }
  for (int v = 0; v < height; ++v) {
    double row[kMaxChannels] = {};
    std::int32_t in_row = 0;
    std::size_t at = (static_cast<std::size_t>(v) + 1) * stride_;
    counts_[at] = 0;
    for (std::size_t c = 0; c < channels_; ++c) sums_[c * plane_ + at] = 0.0;
    for (int u = 0; u < width; ++u) {
      ++at;
      double values[kMaxChannels] = {};
      if (value_of(u, v, values)) {
        ++in_row;
        for (std::size_t c = 0; c < channels_; ++c) row[c] += values[c];
      }
      counts_[at] = counts_[at - stride_] + in_row;
      for (std::size_t c = 0; c < channels_; ++c) {
        sums_[c * plane_ + at] = sums_[c * plane_ + at - stride_] + row[c];
      }
    }
  }
}

}  // namespace grapnel
