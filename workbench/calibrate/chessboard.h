#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "base/image.h"

namespace grapnel {

/// Grey values, rows packed.
struct GrayImage {
  int width = 0;
  int height = 0;
  std::vector<float> pixels;

  [[nodiscard]] float at(int u, int v) const {
    return pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(u)];
  }
};

[[nodiscard]] GrayImage gray_of(ImageView<const Rgb8> color);

/// The inner corners of a chessboard of columns × rows of them, row by row, to a fraction of a
/// pixel: saddle points of the smoothed image that form a grid of exactly that size. A board turned
/// by half a turn looks the same. Nothing when there is no such grid or part of it is hidden.
[[nodiscard]] std::optional<std::vector<Eigen::Vector2d>> find_chessboard(const GrayImage& image,
                                                                          int columns, int rows);

}  // namespace grapnel
