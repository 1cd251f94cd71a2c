#pragma once

#include <cstdint>
#include <span>

namespace grapnel::test {

// Each feeds `data` to one reader, which must answer or throw InputError; nothing else may leave
// it, and what it answers must be consistent. A broken promise ends the program.

void run_cloud_file(std::span<const std::uint8_t> data);   ///< PCD or PLY, as cloud and as mesh
void run_config_file(std::span<const std::uint8_t> data);  ///< TOML, and as a grapnel.toml
void run_camera_file(std::span<const std::uint8_t> data);
void run_recording_index(std::span<const std::uint8_t> data);  ///< images and poses
void run_image_file(std::span<const std::uint8_t> data);       ///< PNG, JPEG
void run_snapshot(std::span<const std::uint8_t> data);

}  // namespace grapnel::test
