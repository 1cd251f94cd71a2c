#include "tests/support/small_recording.h"

#include "drivers/replay/recording_writer.h"

namespace grapnel::test {
namespace {

constexpr std::size_t kPixels = std::size_t{kSmallWidth} * kSmallHeight;

}  // namespace

CameraFile small_camera() {
  CameraFile camera;
  camera.width = kSmallWidth;
  camera.height = kSmallHeight;
  camera.fx = 30.0;
  camera.fy = 31.0;
  camera.cx = 15.5;
  camera.cy = 11.5;
  camera.metres_per_unit = 0.001;
  camera.baseline_m = 0.08;
  camera.serial = "SMALL-1";
  return camera;
}

std::uint16_t small_depth(std::size_t frame, std::size_t pixel) noexcept {
  if (pixel % 11 == 0) return 0;
  return static_cast<std::uint16_t>(1000 + 10 * frame + pixel % 7);
}

Rgb8 small_color(std::size_t frame, std::size_t pixel) noexcept {
  return {static_cast<std::uint8_t>(frame), static_cast<std::uint8_t>(pixel % 251),
          static_cast<std::uint8_t>(200 - frame % 100)};
}

std::size_t frame_shown(ImageView<const std::uint16_t> depth) noexcept {
  return (static_cast<std::size_t>(depth.data[7]) - 1000) / 10;
}

void write_small_recording(const std::filesystem::path& folder, std::size_t frames,
                           bool with_color) {
  RecordingWriter writer(folder, small_camera());
  std::vector<std::uint16_t> depth(kPixels);
  std::vector<Rgb8> color(kPixels);
  for (std::size_t frame = 0; frame < frames; ++frame) {
    for (std::size_t pixel = 0; pixel < kPixels; ++pixel) {
      depth[pixel] = small_depth(frame, pixel);
      color[pixel] = small_color(frame, pixel);
    }
    const std::int64_t time_us =
        kSmallStart_us + static_cast<std::int64_t>(frame) * kSmallInterval_us;
    writer.add_depth(time_us, {depth.data(), kSmallWidth, kSmallHeight});
    if (with_color) writer.add_color(time_us + 500, {color.data(), kSmallWidth, kSmallHeight});
  }
}

}  // namespace grapnel::test
