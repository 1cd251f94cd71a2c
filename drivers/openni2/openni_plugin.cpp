// The plug-in's entry point.
#include <dlfcn.h>

#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>

#include "drivers/live/live_camera.h"
#include "drivers/live/plugin_list.h"
#include "drivers/openni2/api_thread.h"
#include "drivers/openni2/oni_device.h"
#include "drivers/openni2/openni_device.h"
#include "hal/camera_plugin.h"

namespace {

// A frame is stamped when it is complete; its exposure's middle lies half a frame earlier.
constexpr std::int64_t kHalfFrame_us = 16'667;
constexpr std::int64_t kBringUp_us = 5'000'000;

bool launch_on_api_thread(grapnel::DeviceSession* session) {
  return grapnel::post_to_openni([session] { session->run(); });
}

/// The folder of this plug-in.
std::filesystem::path own_folder() {
  Dl_info info{};
  if (::dladdr(reinterpret_cast<void*>(&launch_on_api_thread), &info) == 0) return {};
  return std::filesystem::absolute(info.dli_fname).parent_path();
}

/// OpenNI stays down in this process: the player has its own.
grapnel::Camera* play(const grapnel::OpenNiOptions& options) {
  grapnel::LiveDriver driver;
  const std::filesystem::path player = own_folder() / grapnel::kOniPlayer;
  driver.make_device = [options, player] {
    return std::make_unique<grapnel::OniDevice>(options, player);
  };
  driver.launch = &grapnel::launch_session_on_own_thread;
  driver.latency_us = kHalfFrame_us;
  return std::make_unique<grapnel::LiveCamera>(driver).release();
}

grapnel::Camera* create(const char* options_toml, const grapnel::Clock*, char* problem,
                        std::size_t problem_bytes) {
  try {
    const grapnel::OpenNiOptions options =
        grapnel::read_openni_options(grapnel::parse_config(options_toml, "camera"));
    if (!options.recording.empty()) return play(options);
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
