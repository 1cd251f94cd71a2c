#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <new>

#include "base/image.h"

namespace grapnel::test {

/// A depth camera behind OpenNI and what befalls it, in the file that the environment's
/// GRAPNEL_FAKE_OPENNI names: the test steers, the driver inside OpenNI obeys.
struct FakeSensor {
  static constexpr std::size_t kSerialBytes = 24;

  std::atomic<std::int32_t> plugged{1};
  std::atomic<std::int32_t> address{3};  ///< a changed one is another plugging-in
  char serial[kSerialBytes] = "1206090012";
  std::atomic<std::int32_t> color{1};      ///< the device has a colour stream
  std::atomic<std::int32_t> registers{1};  ///< and can register depth to it
  std::atomic<std::int32_t> speed_up{1};   ///< frames come so many times faster than 30 Hz
  std::atomic<std::int32_t> color_skew_us{400};
  std::atomic<std::int32_t> color_frozen{0};
  std::atomic<std::int32_t> silent{0};        ///< no frames
  std::atomic<std::int32_t> skip_frames{0};   ///< so many frames never come
  std::atomic<std::int32_t> stuck_mirror{0};  ///< mirroring can't be switched off
  std::atomic<std::int32_t> says_goodbye{1};  ///< unplugging is told by callback
  std::atomic<std::int32_t> hang_open{0};
  std::atomic<std::int32_t> hang_start{0};
  std::atomic<std::int32_t> hang_stop{0};

  std::atomic<std::int32_t> no_cropping{0};  ///< the streams know no cropping

  std::atomic<std::int32_t> driver_up{0};  ///< OpenNI has loaded the driver
  std::atomic<std::int32_t> announced{0};  ///< the address at which OpenNI knows the device
  std::atomic<std::uint64_t> depth_frames{0};
  std::atomic<std::int32_t> opened{0};   ///< devices open now
  std::atomic<std::int32_t> streams{0};  ///< streams made and not destroyed
  std::atomic<std::int32_t> running{0};  ///< streams started and not stopped
};

inline constexpr int kSensorWidth = 640;
inline constexpr int kSensorHeight = 480;
inline constexpr std::uint64_t kSensorPictures = 8;
inline constexpr float kSensorHorizontalFov_rad = 1.0145F;
inline constexpr float kSensorVerticalFov_rad = 0.7898F;

/// Depth of frame `index` in millimetres, unmirrored; without symmetry.
[[nodiscard]] constexpr std::uint16_t sensor_depth_mm(int u, int v, std::uint64_t index) noexcept {
  if ((u + 2 * v) % 89 == 0) return 0;
  const auto phase = static_cast<int>(index % kSensorPictures);
  return static_cast<std::uint16_t>(600 + (u + 3 * v + 41 * phase) % 700);
}

[[nodiscard]] constexpr Rgb8 sensor_color(int u, int v, std::uint64_t index) noexcept {
  return {static_cast<std::uint8_t>(u), static_cast<std::uint8_t>(v),
          static_cast<std::uint8_t>(u / 4 + static_cast<int>(index % kSensorPictures))};
}

/// Maps the file; nullptr when the environment names none.
inline FakeSensor* map_fake_sensor() {
  const char* const file = std::getenv("GRAPNEL_FAKE_OPENNI");
  const int descriptor = file == nullptr ? -1 : ::open(file, O_RDWR | O_CLOEXEC);
  if (descriptor < 0) return nullptr;
  void* const memory =
      ::mmap(nullptr, sizeof(FakeSensor), PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  ::close(descriptor);
  return memory == MAP_FAILED ? nullptr : static_cast<FakeSensor*>(memory);
}

}  // namespace grapnel::test
