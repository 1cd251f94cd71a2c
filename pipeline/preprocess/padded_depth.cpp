#include "pipeline/preprocess/padded_depth.h"

#include <algorithm>

#include "pipeline/kernels/depth_rows.h"

namespace grapnel {

namespace {

constexpr std::size_t kBorders = 2 * PaddedDepth::kBorder;

}  // namespace

void PaddedDepth::reserve(Arena& arena, const Limits& limits) {
  // A region of the allowed pixel count may be narrow and tall or wide and flat; none is longer
  // than the frame either way.
  const auto width = static_cast<std::size_t>(limits.max_width);
  const auto height = static_cast<std::size_t>(limits.max_height);
  const std::size_t longest = std::max(width, height);
  memory_ = arena.take<std::uint16_t>(width * height + kBorders * width +
                                      (kBorders + 1) * kernels::kDepthSlack * (longest + kBorders));
}

void PaddedDepth::copy(const ImageView<const std::uint16_t>& depth) noexcept {
  const auto width = static_cast<std::size_t>(depth.width);
  const auto height = static_cast<std::size_t>(depth.height);
  stride_ = width + kBorders + kernels::kDepthSlack;
  GRAPNEL_ASSERT(stride_ * (height + kBorders) <= memory_.size());
  std::fill_n(memory_.begin(), stride_ * kBorder, std::uint16_t{0});
  for (std::size_t v = 0; v < height; ++v) {
    std::uint16_t* to = memory_.data() + (v + kBorder) * stride_;
    std::fill_n(to, kBorder, std::uint16_t{0});
    std::copy_n(depth.row(static_cast<int>(v)), width, to + kBorder);
    std::fill_n(to + kBorder + width, stride_ - kBorder - width, std::uint16_t{0});
  }
  std::fill_n(memory_.data() + (height + kBorder) * stride_, stride_ * kBorder, std::uint16_t{0});
}

}  // namespace grapnel
