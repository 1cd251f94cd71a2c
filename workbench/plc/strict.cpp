#include "workbench/plc/strict.h"

#include <algorithm>

#include "base/clock.h"

namespace grapnel {
namespace {

constexpr std::int64_t kPollUs = 2000;

/// One run of a strict cycle.
class Cycle {
 public:
  Cycle(PlcClient& client, const StrictCycle& cycle) : client_(client), cycle_(cycle) {
    command_ = cycle.command;
  }

  bool run() {
    const std::int64_t start_us = clock_.now_us();
    for (std::int64_t i = 0; i < cycle_.count; ++i) {
      if (!read_until(start_us + i * cycle_.interval_ms * 1000) || !trigger()) return false;
    }
    const std::int64_t end_us = clock_.now_us() + cycle_.answer_timeout_ms * 1000;
    while (pending_ && clock_.now_us() < end_us) {
      if (!read_until(clock_.now_us() + kPollUs)) return false;
    }
    lose_pending();
    return true;
  }
  [[nodiscard]] const StrictTally& tally() const { return tally_; }

 private:
  struct Pending {
    std::uint16_t seq = 0;
    std::int64_t sent_us = 0;
  };

  /// Reads at least once, so that an answer is seen before the next trigger replaces it.
  bool read_until(std::int64_t until_us) {
    for (;;) {
      PlcReading reading;
      if (!client_.beat_if_due() || !client_.read(reading)) return false;
      take_answer(reading);
      const std::int64_t now_us = clock_.now_us();
      if (now_us >= until_us) return true;
      clock_.sleep_until_us(std::min(until_us, now_us + kPollUs));
    }
  }

  bool trigger() {
    const std::int64_t sent_us = clock_.now_us();
    PlcReading reading;
    if (!client_.send(command_) || !client_.read(reading)) return false;
    ++tally_.triggers;
    ++command_.part_tag;
    if (reading.status.ack_code == Code::Accepted) {
      lose_pending();
      pending_ = Pending{command_.seq, sent_us};
    } else if (reading.status.ack_code == Code::Busy) {
      ++tally_.refused_busy;
    } else {
      ++tally_.refused_other;
    }
    take_answer(reading);
    return true;
  }

  void take_answer(const PlcReading& reading) {
    const PlcResult& result = reading.result;
    const bool done = (reading.status.flags & kFlagDone) != 0;
    if (!pending_ || !done || result.cmd_seq != pending_->seq) return;
    const std::int64_t latency_us = clock_.now_us() - pending_->sent_us;
    const std::int64_t limit_us = std::int64_t{cycle_.command.timeout_ms} * 1000;
    const bool late = result.code == Code::JobDeadline || (limit_us > 0 && latency_us > limit_us);
    ++tally_.answered;
    if (late) ++tally_.late;
    if (!result.objects.empty() && result.objects[0].accepted) ++tally_.accepted;
    ++tally_.codes[static_cast<int>(result.code)];
    tally_.latencies_us.push_back(latency_us);
    pending_.reset();
  }

  void lose_pending() {
    if (pending_) ++tally_.lost;
    pending_.reset();
  }

  PlcClient& client_;
  const StrictCycle& cycle_;
  PlcCommand command_;
  MonotonicClock clock_;
  std::optional<Pending> pending_;
  StrictTally tally_;
};

}  // namespace

std::optional<StrictTally> run_strict_cycle(PlcClient& client, const StrictCycle& cycle) {
  Cycle run(client, cycle);
  if (!run.run()) return std::nullopt;
  return run.tally();
}

}  // namespace grapnel
