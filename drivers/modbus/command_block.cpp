#include "drivers/modbus/command_block.h"

#include <algorithm>
#include <limits>

namespace grapnel {
namespace {

namespace c = registers::command;

constexpr std::int64_t kShortestLimitUs = 500'000;
constexpr std::int64_t kLongestLimitUs = 60'000'000;

PlcCommand read_command(const RegisterImage& image, std::int64_t now_us) noexcept {
  PlcCommand command;
  command.seq = image.u16(c::kCmdSeq);
  command.code = image.u16(c::kCmdCode);
  command.preset_id = image.u16(c::kPresetId);
  command.model_id = image.u16(c::kModelId);
  command.max_objects = image.u16(c::kMaxObjects);
  command.options = image.u16(c::kOptions);
  command.timeout_ms = image.u16(c::kTimeoutMs);
  command.pose_format = image.u16(c::kPoseFormat);
  command.enc_trigger = image.u32(c::kEncTrigger);
  command.part_tag = image.u32(c::kPartTag);
  for (std::size_t i = 0; i < command.robot_pose.size(); ++i) {
    command.robot_pose[i] = image.i32(c::kRobotPose + 2 * i);
  }
  command.accepted_us = now_us;
  return command;
}

}  // namespace

void CommandBlock::release(PeerId peer) noexcept {
  if (peer == kNoPeer || owner_ != peer) return;
  owner_ = kNoPeer;
  sink_->on_control_lost();
}

bool CommandBlock::after_write(std::int64_t now_us, bool encoder_alone) noexcept {
  note_heartbeat(now_us);
  if (encoder_alone) sink_->on_encoder(image_->u32(c::kEncTrigger), now_us);
  return run_command(now_us);
}

bool CommandBlock::run_command(std::int64_t now_us) noexcept {
  const std::uint16_t seq = image_->u16(c::kCmdSeq);
  if (seq == last_seq_) return false;
  last_seq_ = seq;
  if (seq == 0) return false;
  const PlcCommand command = read_command(*image_, now_us);
  const Code answer = sink_->on_command(command);
  return answer == Code::Accepted &&
         command.code == static_cast<std::uint16_t>(PlcCommandCode::ClearCounters);
}

void CommandBlock::note_heartbeat(std::int64_t now_us) noexcept {
  const std::uint16_t limit_ms = image_->u16(c::kHbLimitMs);
  const std::uint16_t beat = image_->u16(c::kHbIn);
  const bool was_supervised = limit_us_ != 0;
  limit_us_ = limit_ms == 0 ? 0
                            : std::clamp<std::int64_t>(limit_ms * std::int64_t{1000},
                                                       kShortestLimitUs, kLongestLimitUs);
  const bool moved = beat != last_beat_;
  last_beat_ = beat;
  if (moved || !was_supervised) last_beat_us_ = now_us;
  if (heartbeat_lost_ && (moved || limit_us_ == 0)) {
    heartbeat_lost_ = false;
    sink_->on_heartbeat_lost(false);
  }
}

void CommandBlock::supervise(std::int64_t now_us) noexcept {
  if (now_us < heartbeat_deadline_us()) return;
  heartbeat_lost_ = true;
  sink_->on_heartbeat_lost(true);
  release(owner_);
}

std::int64_t CommandBlock::heartbeat_deadline_us() const noexcept {
  if (limit_us_ == 0 || heartbeat_lost_) return std::numeric_limits<std::int64_t>::max();
  return last_beat_us_ + limit_us_;
}

}  // namespace grapnel
