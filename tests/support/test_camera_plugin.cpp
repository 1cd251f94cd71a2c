// A camera plug-in for the tests: the replay driver behind the plug-in's entry point.
#include <cstdio>
#include <exception>
#include <memory>

#include "base/config.h"
#include "drivers/replay/replay_camera.h"
#include "hal/camera_plugin.h"

namespace {

grapnel::Camera* create(const char* options_toml, const grapnel::Clock* clock, char* problem,
                        std::size_t problem_bytes) {
  try {
    const grapnel::ConfigTable options = grapnel::parse_config(options_toml, "options");
    return grapnel::make_replay_camera(options, *clock).release();
  } catch (const std::exception& error) {
    std::snprintf(problem, problem_bytes, "%s", error.what());
    return nullptr;
  }
}

void destroy(grapnel::Camera* camera) { delete camera; }

int list(char* lines, std::size_t bytes) {
  std::snprintf(lines, bytes, "1 test\n");
  return 1;
}

constexpr GrapnelCameraPlugin kPlugin = {kGrapnelCameraAbi + GRAPNEL_TEST_ABI_OFFSET, "test",
                                         &create, &destroy, &list};

}  // namespace

extern "C" const GrapnelCameraPlugin* grapnel_camera_plugin() { return &kPlugin; }
