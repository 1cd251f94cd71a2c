#pragma once

#include <vector>

#include "hal/plc.h"

namespace grapnel::test {

/// A device that answers what the test says and keeps what it was told.
class ScriptedDevice final : public PlcCommandSink {
 public:
  ScriptedDevice() {
    commands.reserve(1024);
    encoder_counts.reserve(1024);
  }

  Code on_command(const PlcCommand& command) noexcept override {
    commands.push_back(command);
    status.ack_seq = command.seq;
    status.ack_code = answer;
    if (answer != Code::Accepted) return answer;
    status.result_no = 0;
    status.flags = kFlagBusy;
    if (finish_at_once) finish(command.seq, command.part_tag);
    return answer;
  }
  void on_heartbeat_lost(bool lost) noexcept override {
    heartbeat_lost = lost;
    ++heartbeat_changes;
  }
  void on_encoder(std::uint32_t count, std::int64_t) noexcept override {
    encoder_counts.push_back(count);
  }
  void on_control_lost() noexcept override { ++control_losses; }
  void read_status(PlcStatus& out) noexcept override { out = status; }
  void read_result(PlcResult& out) noexcept override {
    out = result;
    ++result_reads;
  }

  /// Publishes `result` as the answer to a command.
  void finish(std::uint16_t seq, std::uint32_t part_tag) noexcept {
    result.cmd_seq = seq;
    result.part_tag = part_tag;
    status.result_no = ++results;
    const bool accepted = !result.objects.empty() && result.objects[0].accepted;
    status.flags =
        static_cast<std::uint16_t>(kFlagReady | kFlagDone | (accepted ? kFlagResultValid : 0));
  }

  PlcStatus status;
  PlcResult result;
  Code answer = Code::Accepted;
  bool finish_at_once = true;
  std::vector<PlcCommand> commands;
  std::vector<std::uint32_t> encoder_counts;
  std::uint64_t results = 0;
  int result_reads = 0;
  bool heartbeat_lost = false;
  int heartbeat_changes = 0;
  int control_losses = 0;
};

/// An accepted object at a pose whose registers are easy to know.
inline PlcObject accepted_object() {
  PlcObject object;
  object.model_id = 7;
  object.accepted = true;
  object.code = Code::ObjectFound;
  object.frame_from_grasp.translation() = Vec3d(0.123456, -0.2, 1.5);
  return object;
}

}  // namespace grapnel::test
