#include "pipeline/preprocess/integral_image.h"

#include "base/assert.h"

namespace grapnel {

void IntegralImage::reserve(Arena& arena, std::size_t channels, std::size_t max_pixels,
                            std::size_t max_edge) {
  GRAPNEL_ASSERT(channels <= kMaxChannels);
  channels_ = channels;
  // A row and a column before the image, whichever way it lies.
  plane_ = max_pixels + 2 * max_edge + 1;
  sums_ = arena.take<double>(channels * plane_);
  counts_ = arena.take<std::int32_t>(plane_);
}

bool IntegralImage::fits(int width, int height) const noexcept {
  return (static_cast<std::size_t>(width) + 1) * (static_cast<std::size_t>(height) + 1) <= plane_;
}

}  // namespace grapnel
