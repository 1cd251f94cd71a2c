#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "drivers/live/frame_exchange.h"

namespace grapnel {

/// Brings the depth and the colour of one moment together: within 2 ms of the device's time. A
/// depth frame waits a short while for its colour, then goes without.
class ColorPairing {
 public:
  static constexpr std::int64_t kSameMoment_us = 2'000;
  static constexpr std::int64_t kPatience_us = 12'000;

  /// Writes the colour of each pixel of `slot.depth` into `slot.color`.
  using Attach = std::function<void(FrameExchange::Slot& slot, const std::vector<Rgb8>& color)>;

  ColorPairing(bool wants_color, Attach attach)
      : wants_color_(wants_color), attach_(std::move(attach)) {}

  /// A stream begins, for this exchange.
  void begin(FrameExchange& exchange) noexcept;
  /// A slot for a depth frame that has arrived, whose pixels the caller then fills in before
  /// depth_ready(); nullptr when the frame has no place. What waited before goes without colour.
  [[nodiscard]] FrameExchange::Slot* depth_arrives(const SensorStamp& stamp);
  void depth_ready();
  /// Colour of the depth image's size has arrived.
  void color_arrives(const Rgb8* pixels, std::size_t count, std::int64_t device_us,
                     std::uint32_t lost_packets);
  /// To be called after every look at the streams: lets go what has waited long enough. On a
  /// machine that lags, the colour may have arrived and not been looked at: one more look is due
  /// then.
  void tick(std::int64_t now_us);
  /// The streams have ended: what waits is dropped.
  void end() noexcept;

 private:
  [[nodiscard]] bool paired() const noexcept;
  void publish(bool with_color);

  bool wants_color_;
  Attach attach_;
  FrameExchange* exchange_ = nullptr;
  FrameExchange::Slot* waiting_ = nullptr;
  std::vector<Rgb8> color_;
  bool has_color_ = false;
  bool overdue_ = false;  // at the last look, the waiting frame had waited long enough
  std::int64_t color_us_ = 0;
  std::uint32_t color_lost_ = 0;
};

}  // namespace grapnel
