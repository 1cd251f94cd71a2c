#pragma once

#include <span>
#include <string>

namespace grapnel {

/// `grapnel plc HOST:PORT --events FILE …`: the emulator beside a simulated line. Triggers whenever
/// a station of the recording has come to rest, asks for the part that ought to lie there, and
/// compares what the device answers with the truth. Exit status 1 when an answer was not as
/// expected.
[[nodiscard]] int run_plc_line(std::span<const std::string> args);

}  // namespace grapnel
