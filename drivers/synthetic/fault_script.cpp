#include "drivers/synthetic/fault_script.h"

namespace grapnel {

FrameFaults faults_at(std::span<const SceneFault> faults, std::int64_t frame) noexcept {
  FrameFaults found;
  for (const SceneFault& fault : faults) {
    const bool goes_away =
        fault.kind == FaultKind::Disconnect || fault.kind == FaultKind::WrongSerial;
    const bool for_good = goes_away && fault.frames == 0;
    const bool now = frame >= fault.at_frame && (for_good || frame < fault.at_frame + fault.frames);
    if (!now) continue;
    switch (fault.kind) {
      case FaultKind::Stall:
        found.missing = true;
        break;
      case FaultKind::Drop:
        found.missing = true;
        found.dropped = true;
        break;
      case FaultKind::Torn:
        found.torn = true;
        break;
      case FaultKind::AllZero:
        found.all_zero = true;
        break;
      case FaultKind::WrongSerial:
        found.wrong_serial = true;
        [[fallthrough]];
      case FaultKind::Disconnect:
        found.missing = true;
        found.lost = true;
        break;
      case FaultKind::ClockWrap:
        break;
    }
  }
  return found;
}

std::uint32_t device_ticks(std::span<const SceneFault> faults, double rate_hz,
                           std::int64_t time_us) noexcept {
  std::int64_t wrap_at_us = 0;
  for (const SceneFault& fault : faults) {
    if (fault.kind != FaultKind::ClockWrap) continue;
    wrap_at_us = static_cast<std::int64_t>(static_cast<double>(fault.at_frame) * 1e6 / rate_hz);
  }
  return static_cast<std::uint32_t>((time_us - wrap_at_us) * kDeviceTicksPerUs);
}

}  // namespace grapnel
