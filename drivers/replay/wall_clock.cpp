#include "drivers/replay/wall_clock.h"

#include <chrono>

namespace grapnel {

std::int64_t wall_clock_offset_us(const Clock& clock) {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(since_1970).count() - clock.now_us();
}

}  // namespace grapnel
