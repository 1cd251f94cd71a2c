#pragma once

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <new>
#include <string>
#include <thread>

#include "tests/support/fake_openni/fake_sensor.h"
#include "tests/support/temp_folder.h"

namespace grapnel::test {

/// The file through which this process and its children meet the fake sensor; GRAPNEL_FAKE_OPENNI
/// names it from then on. One for the life of the program: OpenNI reads it for as long.
inline FakeSensor& fake_sensor() {
  static const TempFolder folder;
  static FakeSensor* const sensor = [] {
    const std::string file = (folder / "sensor").string();
    std::ofstream(file, std::ios::binary) << std::string(sizeof(FakeSensor), '\0');
    ::setenv("GRAPNEL_FAKE_OPENNI", file.c_str(), 1);
    return new (map_fake_sensor()) FakeSensor;
  }();
  return *sensor;
}

/// Plugs the sensor in at another address; OpenNI, where it runs, knows of it afterwards.
inline void plug_in(FakeSensor& sensor) {
  const std::int32_t address = ++sensor.address;
  sensor.plugged = 1;
  for (int look = 0; sensor.driver_up != 0 && sensor.announced != address && look < 5000; ++look) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

}  // namespace grapnel::test
