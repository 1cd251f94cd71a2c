#pragma once

#include <cstdint>

#include "base/clock.h"

namespace grapnel {

/// From monotonic to the wall clock's time, for RecorderOptions::time_offset_us. Taken once a
/// recording: its index never jumps.
[[nodiscard]] std::int64_t wall_clock_offset_us(const Clock& clock);

}  // namespace grapnel
