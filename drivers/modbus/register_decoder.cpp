#include "drivers/modbus/register_decoder.h"

#include "base/math.h"

namespace grapnel {
namespace {

constexpr double kRatio = 1e-4;
constexpr double kMetresPerMicrometre = 1e-6;
constexpr double kRadPerMdeg = math::kPi / 180000.0;

Code code_at(const RegisterImage& image, std::size_t address) noexcept {
  return static_cast<Code>(image.u16(address));
}

}  // namespace

PlcStatus decode_status(const RegisterImage& image) noexcept {
  namespace s = registers::status;
  PlcStatus status;
  status.state = static_cast<PlcState>(image.u16(s::kState));
  status.flags = image.u16(s::kFlags);
  status.heartbeat = image.u16(s::kHbOut);
  status.ack_seq = image.u16(s::kAckSeq);
  status.ack_code = code_at(image, s::kAckCode);
  status.recording = static_cast<PlcRecording>(image.u16(s::kRecording));
  status.status_code = code_at(image, s::kStatusCode);
  status.status_detail = image.u16(s::kStatusDetail);
  status.active_preset = image.u16(s::kActivePreset);
  status.preset_rev = image.u16(s::kPresetRev);
  status.error_count = image.u16(s::kErrCount);
  status.uptime_s = image.u32(s::kUptimeS);
  status.frame_count = image.u32(s::kFrameCount);
  status.boot_id = image.u16(s::kBootId);
  status.result_no = image.u16(registers::result::kResNoBegin);
  return status;
}

PlcResult decode_result_head(const RegisterImage& image) noexcept {
  namespace r = registers::result;
  PlcResult result;
  result.cmd_seq = image.u16(r::kResCmdSeq);
  result.code = code_at(image, r::kResCode);
  result.found = image.u16(r::kNFound);
  result.pose_format = image.u16(r::kRecordFirst + registers::object::kPoseFormat);
  result.frame_id = image.u32(r::kFrameId);
  result.enc_capture = image.u32(r::kEncCapture);
  result.capture_delay_us = image.u32(r::kCaptureDelayUs);
  result.age_us = image.u32(r::kAgeUs);
  result.part_tag = image.u32(r::kPartTag);
  result.retries = image.u16(r::kRetries);
  result.total_us = image.u32(r::kTTotalUs);
  result.preset = image.u16(r::kResPreset);
  result.preset_rev = image.u16(r::kResPresetRev);
  result.seed = image.u32(r::kResSeed);
  return result;
}

PoseRegisters decode_pose_registers(const RegisterImage& image, std::size_t base) noexcept {
  PoseRegisters pose{};
  for (std::size_t i = 0; i < pose.size(); ++i) {
    pose[i] = image.i32(base + registers::object::kX + 2 * i);
  }
  return pose;
}

PlcObject decode_object(const RegisterImage& image, std::size_t base) noexcept {
  namespace o = registers::object;
  PlcObject object;
  object.model_id = image.u16(base + o::kModelId);
  object.pick_point_id = image.u16(base + o::kPickPointId);
  object.frame = static_cast<PoseFrame>(image.u16(base + o::kFrame));
  object.fitness = image.u16(base + o::kFitness) * kRatio;
  object.rmse_m = image.u16(base + o::kRmseUm) * kMetresPerMicrometre;
  object.coverage = image.u16(base + o::kCoverage) * kRatio;
  object.margin = image.u16(base + o::kMargin) * kRatio;
  object.free_space_violation = image.u16(base + o::kFreeSpaceViol) * kRatio;
  object.sigma_m = image.u16(base + o::kSigmaUm) * kMetresPerMicrometre;
  object.sigma_rad = image.u16(base + o::kSigmaMdeg) * kRadPerMdeg;
  object.quality_bits = image.u16(base + o::kQuality);
  object.quality_score = image.u16(base + o::kQualityScore);
  object.code = code_at(image, base + o::kObjCode);
  object.reasons = image.u32(base + o::kReasons);
  const std::uint16_t format = image.u16(base + o::kPoseFormat);
  const std::uint16_t decision = image.u16(base + o::kDecision);
  const bool known = decision == kDecisionModelPose || decision == kDecisionSurfaceGrasp;
  if (!known || !is_pose_format(format)) return object;
  const Result<Pose> pose =
      decode_pose(decode_pose_registers(image, base), static_cast<PoseFormat>(format));
  object.accepted = pose.ok() && decision == kDecisionModelPose;
  object.surface_grasp = pose.ok() && decision == kDecisionSurfaceGrasp;
  if (pose) object.frame_from_grasp = pose.value();
  return object;
}

void encode_command(const PlcCommand& command, RegisterImage& image) noexcept {
  namespace c = registers::command;
  image.set_u16(c::kCmdSeq, command.seq);
  image.set_u16(c::kCmdCode, command.code);
  image.set_u16(c::kPresetId, command.preset_id);
  image.set_u16(c::kModelId, command.model_id);
  image.set_u16(c::kMaxObjects, command.max_objects);
  image.set_u16(c::kOptions, command.options);
  image.set_u16(c::kTimeoutMs, command.timeout_ms);
  image.set_u16(c::kPoseFormat, command.pose_format);
  image.set_u32(c::kEncTrigger, command.enc_trigger);
  image.set_u32(c::kPartTag, command.part_tag);
  for (std::size_t i = 0; i < command.robot_pose.size(); ++i) {
    image.set_i32(c::kRobotPose + 2 * i, command.robot_pose[i]);
  }
}

}  // namespace grapnel
