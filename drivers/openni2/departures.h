#pragma once

#include <string>

namespace grapnel {

/// Begins to note the devices that OpenNI says have gone. Once a process; on the API thread.
void watch_departures();
/// How often this device has gone since then; a device's name of place.
[[nodiscard]] unsigned departures_of(const std::string& uri);

}  // namespace grapnel
