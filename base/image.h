#pragma once

#include <cstddef>
#include <cstdint>

namespace grapnel {

/// One colour pixel, 8 bits a channel.
struct Rgb8 {
  std::uint8_t r = 0;
  std::uint8_t g = 0;
  std::uint8_t b = 0;

  friend bool operator==(const Rgb8&, const Rgb8&) = default;
};

/// A rectangle of pixels it does not own. Row r starts at data + r * stride (in pixels).
template <class T>
struct ImageView {
  T* data = nullptr;
  int width = 0;
  int height = 0;
  std::size_t stride = 0;

  ImageView() = default;
  ImageView(T* first, int width_px, int height_px)
      : data(first),
        width(width_px),
        height(height_px),
        stride(static_cast<std::size_t>(width_px)) {}
  ImageView(T* first, int width_px, int height_px, std::size_t stride_px)
      : data(first), width(width_px), height(height_px), stride(stride_px) {}
  /// A view that may write converts to one that only reads.
  operator ImageView<const T>() const noexcept { return {data, width, height, stride}; }

  [[nodiscard]] bool empty() const noexcept { return data == nullptr || width == 0 || height == 0; }
  [[nodiscard]] std::size_t pixels() const noexcept {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  [[nodiscard]] T* row(int v) const noexcept { return data + static_cast<std::size_t>(v) * stride; }
  [[nodiscard]] T& at(int u, int v) const noexcept { return row(v)[u]; }
};

}  // namespace grapnel
