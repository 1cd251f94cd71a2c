#include "pipeline/preprocess/temporal_median.h"

#include <algorithm>
#include <array>

#include "base/assert.h"

namespace grapnel {
namespace {

/// Sorts `count` readings in place, those of 0 last.
void sort_readings(std::array<std::uint16_t, TemporalMedian::kMaxFrames>& values,
                   std::size_t count) noexcept {
  // 0 less one is the largest value there is.
  for (std::size_t i = 0; i < count; ++i) --values[i];
  for (std::size_t i = 1; i < count; ++i) {
    for (std::size_t j = i; j > 0; --j) {
      const std::uint16_t low = std::min(values[j - 1], values[j]);
      values[j] = std::max(values[j - 1], values[j]);
      values[j - 1] = low;
    }
  }
  for (std::size_t i = 0; i < count; ++i) ++values[i];
}

}  // namespace

void TemporalMedian::reserve(Arena& arena, std::size_t max_pixels, std::size_t frames) {
  GRAPNEL_ASSERT(frames >= 1 && frames <= kMaxFrames);
  frames_ = arena.take<std::uint16_t>(max_pixels * frames);
  max_pixels_ = max_pixels;
  max_frames_ = frames;
}

Status TemporalMedian::push(ImageView<const std::uint16_t> depth) noexcept {
  if (depth.pixels() > max_pixels_) {
    return Error{Code::CapacityExceeded, Stage::Median, static_cast<std::int32_t>(depth.pixels())};
  }
  if (depth.width != width_ || depth.height != height_) held_ = 0;
  if (held_ == 0) next_ = 0;
  width_ = depth.width;
  height_ = depth.height;
  auto to = frames_.begin() + static_cast<std::ptrdiff_t>(next_ * max_pixels_);
  for (int v = 0; v < height_; ++v) to = std::copy_n(depth.row(v), width_, to);
  next_ = (next_ + 1) % max_frames_;
  held_ = std::min(held_ + 1, max_frames_);
  return {};
}

Status TemporalMedian::median(ImageView<std::uint16_t> out) const noexcept {
  if (held_ == 0) return Error{Code::TooFewPoints, Stage::Median, 0};
  if (out.width != width_ || out.height != height_) {
    return Error{Code::BadParameter, Stage::Median, out.width};
  }
  std::size_t pixel = 0;
  for (int v = 0; v < height_; ++v) {
    std::uint16_t* row = out.row(v);
    for (int u = 0; u < width_; ++u, ++pixel) {
      std::array<std::uint16_t, kMaxFrames> values{};
      std::size_t read = 0;
      for (std::size_t f = 0; f < held_; ++f) {
        values[f] = frames_[f * max_pixels_ + pixel];
        read += values[f] != 0 ? 1U : 0U;
      }
      sort_readings(values, held_);
      row[u] = read == 0 ? std::uint16_t{0} : values[read / 2];
    }
  }
  return {};
}

}  // namespace grapnel
