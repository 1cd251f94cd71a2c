#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/error.h"
#include "base/image.h"

namespace grapnel {

/// Median of the last frames of a standing scene, pixel by pixel over the frames that read
/// something there (upper one of an even count); a pixel that none of them read stays without.
class TemporalMedian {
 public:
  static constexpr std::size_t kMaxFrames = 5;

  void reserve(Arena& arena, std::size_t max_pixels, std::size_t frames);

  /// Forgets all frames: the scene moved.
  void clear() noexcept { held_ = 0; }
  /// Takes a frame in place of the oldest. Another size than the frames held forgets those. Errors:
  /// CapacityExceeded.
  Status push(ImageView<const std::uint16_t> depth) noexcept;
  /// Frames that a median is taken of now.
  [[nodiscard]] std::size_t held() const noexcept { return held_; }
  /// Writes the median into an image of the frames' size. Errors: TooFewPoints (no frame),
  /// BadParameter (another size).
  Status median(ImageView<std::uint16_t> out) const noexcept;

 private:
  std::span<std::uint16_t> frames_;
  std::size_t max_pixels_ = 0;
  std::size_t max_frames_ = 0;
  std::size_t held_ = 0;
  std::size_t next_ = 0;
  int width_ = 0;
  int height_ = 0;
};

}  // namespace grapnel
