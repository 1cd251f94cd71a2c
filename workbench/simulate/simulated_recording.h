#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "drivers/replay/camera_file.h"
#include "drivers/synthetic/scene.h"

namespace grapnel {

/// What a scene's camera says of itself in a recording.
[[nodiscard]] CameraFile camera_file_of(const Scene& scene);

/// What was written.
struct SimulationCounts {
  std::int64_t frames = 0;        ///< of the scene
  std::int64_t depth_images = 0;  ///< fewer where faults took frames
  std::int64_t events = 0;
};

/// Renders a scene into a recording in the TUM layout, and its truth beside it: groundtruth.txt
/// (world_from_camera), objects.jsonl (a line a frame: each visible part's pose and pixels) and,
/// when the scene has events, events.jsonl (a line an event: when to trigger, what to expect). The
/// same scene gives the same bytes. `progress` is called once a frame. Throws InputError when
/// the folder can't be written or holds a recording.
SimulationCounts write_simulated_recording(const Scene& scene, const std::filesystem::path& folder,
                                           const std::function<void()>& progress);

}  // namespace grapnel
