// The plug-in's entry point.
#include <cstdio>
#include <exception>
#include <memory>

#include "drivers/freenect/freenect_device.h"
#include "drivers/live/live_camera.h"
#include "drivers/live/plugin_list.h"
#include "hal/camera_plugin.h"

namespace {

// The stamp is that of the frame's last packet; its exposure's middle lies half a frame earlier.
constexpr std::int64_t kHalfFrame_us = 16'667;

grapnel::Camera* create(const char* options_toml, const grapnel::Clock*, char* problem,
                        std::size_t problem_bytes) {
  try {
    const grapnel::FreenectOptions options =
        grapnel::read_freenect_options(grapnel::parse_config(options_toml, "camera"));
    grapnel::LiveDriver driver;
    driver.make_device = [options] { return std::make_unique<grapnel::FreenectDevice>(options); };
    driver.launch = &grapnel::launch_session_on_own_thread;
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
  return grapnel::list_in_time(
      [] {
        std::vector<std::string> found = grapnel::list_kinects();
        for (std::string& line : found) line += " Kinect v1";
        return found;
      },
      &grapnel::launch_on_own_thread, lines, bytes);
}

constexpr GrapnelCameraPlugin kPlugin = {kGrapnelCameraAbi, "freenect", &create, &destroy, &list};

}  // namespace

extern "C" const GrapnelCameraPlugin* grapnel_camera_plugin() { return &kPlugin; }
