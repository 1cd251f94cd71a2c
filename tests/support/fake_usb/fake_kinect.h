#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "base/image.h"

namespace grapnel::test {

/// A Kinect v1 on a simulated USB, and what befalls it. Lives in the substitute libusb-1.0.so.0,
/// or, when the environment's GRAPNEL_FAKE_KINECT names a file, in that file: another process then
/// steers it.
struct FakeKinect {
  static constexpr std::size_t kSerialBytes = 24;

  std::atomic<std::int32_t> plugged{1};
  std::atomic<std::int32_t> address{5};  ///< a changed one is another plugging-in
  std::atomic<std::int32_t> motor{1};    ///< the motor's own USB device is there
  char serial[kSerialBytes] = "A00362A01234043A";
  std::atomic<std::int32_t> rate_hz{30};
  std::atomic<std::uint32_t> first_ticks{0};  ///< of the 60 MHz counter, at plugging in
  std::atomic<std::int32_t> color_skew_us{500};
  std::atomic<std::int32_t> color_frozen{0};  ///< the colour stream sends nothing
  std::atomic<std::int32_t> silent{0};        ///< no stream sends anything
  std::atomic<std::int32_t> lose_every{0};    ///< each nth packet of all is lost; 0: none
  std::atomic<std::int32_t> lose_next{0};     ///< so many packets in a row, from the next frame on
  std::atomic<std::int32_t> clock_frozen{0};
  std::atomic<std::int32_t> hang_control{0};  ///< control transfers don't return while it is set
  std::atomic<std::int32_t> hang_events{0};   ///< nor do event calls
  std::atomic<std::int32_t> hang_open{0};     ///< nor does opening a device
  std::atomic<std::int32_t> denied{0};        ///< devices are there but may not be opened
  std::atomic<std::int16_t> acceleration[3]{{0}, {819}, {0}};

  std::atomic<std::uint64_t> depth_packets_lost{0};
  std::atomic<std::uint64_t> color_packets_lost{0};
  std::atomic<std::uint64_t> depth_frames{0};  ///< sent, whole or not
  std::atomic<std::int32_t> handles{0};        ///< opened and not closed
  std::atomic<std::int32_t> transfers{0};      ///< allocated and not freed
  std::atomic<std::int32_t> controls{0};       ///< control transfers made
};

inline constexpr int kFakeWidth = 640;
inline constexpr int kFakeHeight = 480;
/// The pictures repeat after so many frames.
inline constexpr std::uint64_t kFakePictures = 8;
inline constexpr std::uint32_t kFakeTicksPerUs = 60;

/// The 11-bit value that frame n carries: no two frames in a row share a pixel's value, and the
/// picture has no symmetry.
[[nodiscard]] constexpr std::uint16_t fake_raw_depth(int u, int v, std::uint64_t n) noexcept {
  if ((u + 2 * v) % 97 == 0) return 2047;
  const auto phase = static_cast<int>(n % kFakePictures);
  return static_cast<std::uint16_t>(500 + (u + 3 * v + 37 * phase) % 400);
}

/// The colour of frame n: two fields, left and right of the middle.
[[nodiscard]] constexpr Rgb8 fake_color(bool left, std::uint64_t n) noexcept {
  const auto phase = static_cast<std::uint8_t>(n % kFakePictures);
  return left ? Rgb8{static_cast<std::uint8_t>(200 + phase), 40, static_cast<std::uint8_t>(90)}
              : Rgb8{10, static_cast<std::uint8_t>(150 + phase), 220};
}

/// Factory constants, of the size that genuine units have.
inline constexpr float kFakeEmitter_cm = 7.5F;
inline constexpr float kFakeColor_cm = 2.3F;
inline constexpr float kFakeReference_mm = 120.0F;
inline constexpr float kFakePixel_mm = 0.1042F;
inline constexpr std::uint16_t kFakeConstShift = 200;

}  // namespace grapnel::test

/// The device of this process.
extern "C" grapnel::test::FakeKinect* grapnel_fake_kinect();
