#pragma once

#include <cstddef>
#include <cstdint>

namespace grapnel::kernels {

/// A small plane patch in an image of 1/z, which is affine there: start + step_u · u + step_v · v,
/// kept within farthest … nearest, over the rectangle u0 … u1, v0 … v1 (inclusive).
struct Disc {
  float start = 0.0F;
  float step_u = 0.0F, step_v = 0.0F;
  float nearest = 0.0F, farthest = 0.0F;
  std::int32_t u0 = 0, u1 = 0, v0 = 0, v1 = 0;  ///< px, of the image's own frame of coordinates
  std::int32_t point = 0;
};

/// An image of 1/z with its point per pixel; pixel (u, v) has index (v - top) · width + u - left.
/// Both planes hold kDiscPad elements more than the image.
struct DiscImage {
  float* inverse_z = nullptr;
  std::int32_t* point = nullptr;
  std::int32_t left = 0;
  std::int32_t top = 0;
  std::int32_t width = 0;
};
inline constexpr std::size_t kDiscPad = 8;

/// Draws discs in their order; a pixel keeps the nearest, of equal ones the first.
void draw_discs(const Disc* discs, std::size_t count, const DiscImage& image) noexcept;

/// Turns `count` inverse depths into depths, 0 stays 0; returns the largest of them before. The row
/// holds kDiscPad elements more, which stay as they are.
float invert_row(float* row, std::size_t count) noexcept;

namespace reference {
float invert_row(float* row, std::size_t count) noexcept;
void draw_discs(const Disc* discs, std::size_t count, const DiscImage& image) noexcept;
}  // namespace reference

}  // namespace grapnel::kernels
