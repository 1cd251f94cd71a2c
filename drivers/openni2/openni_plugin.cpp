// The plug-in's entry point.
#include <cstdint>
#include <cstdio>
#include <exception>
#include <memory>

#include "drivers/live/live_camera.h"
#include "drivers/live/plugin_list.h"
#include "drivers/openni2/api_thread.h"
#include "drivers/openni2/openni_device.h"
#include "hal/camera_plugin.h"

namespace {

// A frame is stamped when it is complete; its exposure's middle lies half a frame earlier.
constexpr std::int64_t kHalfFrame_us = 16'667;
constexpr std::int64_t kBringUp_us = 5'000'000;

bool launch_on_api_thread(grapnel::DeviceSession* session) {
  return grapnel::post_to_openni([session] { session->run(); });
}

grapnel::Camera* create(const char* options_toml, const grapnel::Clock*, char* problem,
                        std::size_t problem_bytes) {
  try {
    const grapnel::OpenNiOptions options =
        grapnel::read_openni_options(grapnel::parse_config(options_toml, "camera"));
    // OpenNI changes the process's working folder while it comes up: now, before the program has
    // other threads to confuse.
    static_cast<void>(grapnel::bring_openni_up(kBringUp_us));
    grapnel::LiveDriver driver;
    driver.make_device = [options] { return std::make_unique<grapnel::OpenNiDevice>(options); };
    driver.launch = &launch_on_api_thread;
    driver.replaceable = false;
    driver.serial = options.serial;
    driver.latency_us = kHalfFrame_us;
    return std::make_unique<grapnel::LiveCamera>(driver).release();
  } catch (const std::exception& error) {
    std::snprintf(problem, problem_bytes, "%s", error.what());
    return nullptr;
  }
}

void destroy(grapnel::Camera* camera) { delete camera; }

int list(char* lines, std::size_t bytes) {
  return grapnel::list_in_time(&grapnel::list_openni_devices, &grapnel::post_to_openni, lines,
                               bytes);
}

constexpr GrapnelCameraPlugin kPlugin = {kGrapnelCameraAbi, "openni2", &create, &destroy, &list};

}  // namespace

extern "C" const GrapnelCameraPlugin* grapnel_camera_plugin() { return &kPlugin; }
