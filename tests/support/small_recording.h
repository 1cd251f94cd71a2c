#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/image.h"
#include "drivers/replay/camera_file.h"

namespace grapnel::test {

inline constexpr int kSmallWidth = 32;
inline constexpr int kSmallHeight = 24;
inline constexpr std::int64_t kSmallStart_us = 1'700'000'000'000'000;
inline constexpr std::int64_t kSmallInterval_us = 10'000;

/// camera.toml of the small recordings: 32×24 pixels, millimetres.
[[nodiscard]] CameraFile small_camera();

/// Depth of pixel `pixel` in frame `frame`: 1000 + 10 × frame + pixel % 7, but 0 where pixel % 11
/// is 0, so that every frame tells its number.
[[nodiscard]] std::uint16_t small_depth(std::size_t frame, std::size_t pixel) noexcept;
[[nodiscard]] Rgb8 small_color(std::size_t frame, std::size_t pixel) noexcept;

/// The frame number that a picture of small_depth() shows.
[[nodiscard]] std::size_t frame_shown(ImageView<const std::uint16_t> depth) noexcept;

/// Writes a recording of `frames` such frames, 10 ms apart, to `folder`.
void write_small_recording(const std::filesystem::path& folder, std::size_t frames,
                           bool with_color);

}  // namespace grapnel::test
