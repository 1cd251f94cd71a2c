#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <system_error>

#include "workbench/doctor/checks.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

struct KnownDevice {
  std::string_view vendor;
  std::string_view product;  ///< "": any
  std::string_view name;
};
constexpr std::array<KnownDevice, 4> kKnown = {{
    {"045e", "02ae", "Kinect camera"},
    {"045e", "02bf", "Kinect for Windows camera"},
    {"1d27", "", "PrimeSense camera"},
    {"2bc5", "", "Orbbec camera"},
}};
constexpr int kHighSpeedMbit = 480;

std::string read_word(const fs::path& file) {
  std::ifstream stream(file);
  std::string word;
  stream >> word;
  return word;
}

int number_in(const fs::path& file) { return std::atoi(read_word(file).c_str()); }

struct UsbCamera {
  std::string name;  ///< with serial
  fs::path folder;
  fs::path node;
  int bus = 0;
};

std::vector<UsbCamera> cameras_in(const SystemRoots& roots) {
  std::vector<UsbCamera> cameras;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(roots.usb_devices, none)) {
    const std::string vendor = read_word(entry.path() / "idVendor");
    const std::string product = read_word(entry.path() / "idProduct");
    for (const KnownDevice& known : kKnown) {
      if (vendor != known.vendor || (!known.product.empty() && product != known.product)) continue;
      UsbCamera camera;
      camera.folder = entry.path();
      camera.bus = number_in(entry.path() / "busnum");
      camera.name = std::string(known.name) + " " + read_word(entry.path() / "serial");
      std::array<char, 16> node{};
      std::snprintf(node.data(), node.size(), "%03d/%03d", camera.bus % 1000,
                    number_in(entry.path() / "devnum") % 1000);
      camera.node = roots.usb_nodes / node.data();
      cameras.push_back(std::move(camera));
    }
  }
  std::sort(cameras.begin(), cameras.end(),
            [](const UsbCamera& a, const UsbCamera& b) { return a.folder < b.folder; });
  return cameras;
}

Diagnosis check_link(const UsbCamera& camera) {
  const int mbit = number_in(camera.folder / "speed");
  if (mbit < kHighSpeedMbit) {
    return {"USB link", Finding::Bad,
            camera.name + " is connected at " + std::to_string(mbit) + " Mbit/s; 480 are needed",
            "another cable or port, without a hub in between"};
  }
  return {"USB link", Finding::Well, camera.name + " at " + std::to_string(mbit) + " Mbit/s", ""};
}

Diagnosis check_permission(const UsbCamera& camera) {
  if (::access(camera.node.c_str(), R_OK | W_OK) == 0) {
    return {"permissions", Finding::Well, camera.name + " can be opened", ""};
  }
  return {
      "permissions", Finding::Bad,
      camera.name + ": " + camera.node.string() + " can't be opened by this user",
      "install 60-grapnel-camera.rules, add the user to the group grapnel-camera, plug in anew"};
}

Diagnosis check_suspend(const UsbCamera& camera) {
  if (read_word(camera.folder / "power" / "control") == "auto") {
    return {"USB suspend", Finding::Warning, camera.name + " may be suspended by the kernel",
            "install 60-grapnel-camera.rules, plug in anew"};
  }
  return {"USB suspend", Finding::Well, camera.name + " is kept awake", ""};
}

}  // namespace

std::vector<Diagnosis> check_usb(const SystemRoots& roots) {
  const std::vector<UsbCamera> cameras = cameras_in(roots);
  if (cameras.empty()) {
    return {{"USB camera", Finding::Warning, "no known depth camera is connected",
             "check the camera's power supply and cable; a Kinect needs its own supply"}};
  }
  std::vector<Diagnosis> found;
  std::map<int, int> on_bus;
  for (const UsbCamera& camera : cameras) {
    found.push_back(check_link(camera));
    found.push_back(check_permission(camera));
    found.push_back(check_suspend(camera));
    ++on_bus[camera.bus];
  }
  for (const auto& [bus, count] : on_bus) {
    if (count < 2) continue;
    found.push_back({"USB bandwidth", Finding::Bad,
                     std::to_string(count) + " cameras share the host controller of bus " +
                         std::to_string(bus) + " and will lose packets",
                     "connect each to a host controller of its own"});
  }
  return found;
}

}  // namespace grapnel
