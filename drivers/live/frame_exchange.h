#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <vector>

#include "base/image.h"
#include "base/signal.h"

namespace grapnel {

/// What a device's thread knows of a frame besides its pixels.
struct SensorStamp {
  std::int64_t device_us = 0;      ///< the device's own clock, unwrapped; any origin
  std::int64_t arrival_us = 0;     ///< host monotonic time at which the library handed it over
  std::uint64_t index = 0;         ///< the device's own frame counter; 0: it has none
  std::uint32_t lost_packets = 0;  ///< of this frame, depth and colour
  std::uint64_t generation = 0;    ///< which opening of the device it came from
};

/// Frames on their way from a capture library's threads to the capture thread: a fixed set of
/// slots, without locks. Threads of earlier openings may still write late; their frames carry an
/// older generation. The one reader takes frames in the order in which they were claimed.
class FrameExchange {
 public:
  static constexpr std::size_t kSlots = 6;

  struct Slot {
    std::vector<std::uint16_t> depth;  ///< width × height
    std::vector<Rgb8> color;           ///< the same, or empty
    bool has_color = false;
    SensorStamp stamp;

   private:
    friend class FrameExchange;
    enum class State : std::uint8_t { Free, Writing, Ready, Reading };
    std::atomic<State> state_{State::Free};
    std::uint64_t order_ = 0;
  };

  /// All memory is taken here.
  FrameExchange(int width, int height, bool with_color);
  FrameExchange(const FrameExchange&) = delete;
  FrameExchange& operator=(const FrameExchange&) = delete;
  ~FrameExchange() = default;

  /// Writer: a slot to fill; nullptr when the reader is behind (the frame is then lost).
  [[nodiscard]] Slot* claim() noexcept;
  void publish(Slot* slot) noexcept;
  void discard(Slot* slot) noexcept;

  /// Reader: the oldest finished frame, nullptr when there is none. Give it back with release().
  [[nodiscard]] Slot* take() noexcept;
  void release(Slot* slot) noexcept;

  [[nodiscard]] const Signal& arrived() const noexcept { return arrived_; }
  void wake() noexcept { arrived_.notify(); }
  [[nodiscard]] int width() const noexcept { return width_; }
  [[nodiscard]] int height() const noexcept { return height_; }

 private:
  int width_;
  int height_;
  std::array<Slot, kSlots> slots_;
  std::atomic<std::uint64_t> claimed_{0};
  Signal arrived_;
};

}  // namespace grapnel
