#include "firmware_app/background.h"

#include <algorithm>
#include <cmath>

#include "firmware_app/plane_fit.h"

namespace grapnel {
namespace {

// At least this share of the image must have a reading, else it was no look at a belt.
constexpr double kMinValidShare = 0.5;

/// Median of the readings of one pixel; 0 when most frames have none.
std::uint16_t median_of(std::array<std::uint16_t, Background::kMaxFrames>& values, int count,
                        int frames) noexcept {
  if (2 * count <= frames) return 0;
  for (int i = 1; i < count; ++i) {
    const std::uint16_t value = values[static_cast<std::size_t>(i)];
    int j = i;
    for (; j > 0 && values[static_cast<std::size_t>(j - 1)] > value; --j) {
      values[static_cast<std::size_t>(j)] = values[static_cast<std::size_t>(j - 1)];
    }
    values[static_cast<std::size_t>(j)] = value;
  }
  return values[static_cast<std::size_t>(count / 2)];
}

}  // namespace

void Background::reserve(Arena& arena, int max_width, int max_height, int frames) {
  const std::size_t pixels =
      static_cast<std::size_t>(max_width) * static_cast<std::size_t>(max_height);
  frames_wanted_ = std::min(frames, kMaxFrames);
  for (Image& image : images_) image.depth = arena.take<std::uint16_t>(pixels);
  for (int i = 0; i < frames_wanted_; ++i) {
    frames_[static_cast<std::size_t>(i)] = arena.take<std::uint16_t>(pixels);
  }
}

void Background::set_plane(const Vec3d& normal, double offset_m) noexcept {
  fixed_plane_ = true;
  fixed_normal_ = normal;
  fixed_offset_m_ = offset_m;
  reference_ = {true, normal, offset_m};
}

void Background::take_reference(const Image& image) noexcept {
  if (!fixed_plane_) reference_ = {image.has_plane, image.plane_normal, image.plane_offset_m};
}

BeltBackground Background::view(const DepthFrame& frame) const noexcept {
  BeltBackground belt;
  const Image& image = images_[in_use_];
  const bool fits = image.width == frame.depth.width && image.height == frame.depth.height &&
                    image.metres_per_unit == frame.metres_per_unit;
  if (image.width > 0 && fits) {
    belt.depth = {image.depth.data(), image.width, image.height};
    belt.has_plane = image.has_plane;
    belt.plane_normal = image.plane_normal;
    belt.plane_offset_m = image.plane_offset_m;
  }
  if (fixed_plane_) {
    belt.has_plane = true;
    belt.plane_normal = fixed_normal_;
    belt.plane_offset_m = fixed_offset_m_;
  }
  return belt;
}

bool Background::begin() noexcept {
  learned_ = 0;
  return to_save_.load(std::memory_order_acquire) < 0;
}

Status Background::add(const DepthFrame& frame) noexcept {
  Image& image = images_[1 - in_use_];
  if (frame.depth.pixels() > image.depth.size()) return Error{Code::CapacityExceeded};
  if (learned_ == 0) {
    image.width = frame.depth.width;
    image.height = frame.depth.height;
    image.metres_per_unit = frame.metres_per_unit;
    image.intrinsics = frame.intrinsics;
  } else if (image.width != frame.depth.width || image.height != frame.depth.height) {
    return Error{Code::SensorMoved};
  }
  if (learned_ >= frames_wanted_) return {};
  std::uint16_t* out = frames_[static_cast<std::size_t>(learned_)].data();
  for (int v = 0; v < image.height; ++v) {
    const std::uint16_t* row = frame.depth.row(v);
    out = std::copy(row, row + image.width, out);
  }
  ++learned_;
  return {};
}

Status Background::finish() noexcept {
  Image& image = images_[1 - in_use_];
  const std::size_t pixels =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  std::size_t valid = 0;
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    std::array<std::uint16_t, kMaxFrames> values;
    int count = 0;
    for (int i = 0; i < learned_; ++i) {
      const std::uint16_t value = frames_[static_cast<std::size_t>(i)][pixel];
      if (value != 0) values[static_cast<std::size_t>(count++)] = value;
    }
    const std::uint16_t median = median_of(values, count, learned_);
    image.depth[pixel] = median;
    if (median != 0) ++valid;
  }
  if (learned_ == 0 || static_cast<double>(valid) < kMinValidShare * static_cast<double>(pixels)) {
    image.width = image.height = 0;
    return Error{Code::DepthMostlyInvalid};
  }
  fit_plane(image);
  in_use_ = 1 - in_use_;
  to_save_.store(static_cast<int>(in_use_), std::memory_order_release);
  return {};
}

void Background::fit_plane(Image& image) noexcept {
  const ImageView<const std::uint16_t> depth{image.depth.data(), image.width, image.height};
  const FittedPlane plane = fit_dominant_plane(depth, image.metres_per_unit, image.intrinsics);
  image.has_plane = plane.found;
  image.plane_normal = plane.normal;
  image.plane_offset_m = plane.offset_m;
}

}  // namespace grapnel
