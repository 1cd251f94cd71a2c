#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "drivers/modbus/plc_client.h"

namespace grapnel {

/// A line that triggers by its own cycle, whatever the device is at.
struct StrictCycle {
  PlcCommand command;
  std::int64_t count = 1;
  std::int64_t interval_ms = 100;
  std::int64_t answer_timeout_ms = 10000;  ///< how long to wait for the last answer
};

/// What came of the triggers: each is in one of refused_busy, refused_other, answered and lost.
struct StrictTally {
  std::size_t triggers = 0;
  std::size_t refused_busy = 0;   ///< ACK_CODE 3002: the last job still ran
  std::size_t refused_other = 0;  ///< any other ACK_CODE that is not 3100
  std::size_t answered = 0;       ///< accepted, and its result read
  std::size_t lost = 0;           ///< accepted, its result never read
  std::size_t late = 0;  ///< of the answered: RES_CODE 1019, or past TIMEOUT_MS where one is given
  std::size_t accepted = 0;                ///< of the answered: object 1 has a pose
  std::map<int, std::size_t> codes;        ///< RES_CODE of the answered
  std::vector<std::int64_t> latencies_us;  ///< of the answered, from the write to the result read
};

/// Triggers `count` times, one every `interval_ms` by the clock, and reads in between. Nothing when
/// the connection fails; the client says why.
[[nodiscard]] std::optional<StrictTally> run_strict_cycle(PlcClient& client,
                                                          const StrictCycle& cycle);

}  // namespace grapnel
