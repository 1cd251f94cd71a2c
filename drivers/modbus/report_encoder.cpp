#include "drivers/modbus/report_encoder.h"

#include <algorithm>
#include <cmath>

#include "base/math.h"
#include "drivers/modbus/pose_format.h"

namespace grapnel {
namespace {

constexpr std::uint16_t kWorst = 65535;
constexpr double kRatioScale = 1e4;

// Rounds and saturates into a register; a value that is not a number reads `if_nan`.
std::uint16_t scaled(double value, double scale, std::uint16_t if_nan) noexcept {
  const double number = std::nearbyint(value * scale);
  if (std::isnan(number)) return if_nan;
  return static_cast<std::uint16_t>(std::clamp(number, 0.0, 65535.0));
}

std::uint16_t number(Code code) noexcept { return static_cast<std::uint16_t>(code); }

std::uint16_t decision_of(const PlcObject& object) noexcept {
  if (object.accepted) return kDecisionModelPose;
  return object.surface_grasp ? kDecisionSurfaceGrasp : kDecisionReject;
}

void encode_pose_registers(const PoseRegisters& pose, std::size_t base,
                           RegisterImage& image) noexcept {
  for (std::size_t i = 0; i < pose.size(); ++i) {
    image.set_i32(base + registers::object::kX + 2 * i, pose[i]);
  }
}

void encode_record(const PlcObject& object, PoseFormat format, std::size_t base,
                   RegisterImage& image) noexcept {
  namespace o = registers::object;
  image.set_u16(base + o::kModelId, object.model_id);
  image.set_u16(base + o::kPickPointId, object.pick_point_id);
  image.set_u16(base + o::kPoseFormat, static_cast<std::uint16_t>(format));
  image.set_u16(base + o::kFrame, static_cast<std::uint16_t>(object.frame));
  image.set_u16(base + o::kDecision, decision_of(object));
  image.set_u16(base + o::kFitness, scaled(object.fitness, kRatioScale, 0));
  image.set_u16(base + o::kRmseUm, scaled(object.rmse_m, 1e6, kWorst));
  image.set_u16(base + o::kCoverage, scaled(object.coverage, kRatioScale, 0));
  image.set_u16(base + o::kMargin, scaled(object.margin, kRatioScale, 0));
  image.set_u16(base + o::kFreeSpaceViol, scaled(object.free_space_violation, kRatioScale, kWorst));
  image.set_u16(base + o::kSigmaUm, scaled(object.sigma_m, 1e6, kWorst));
  image.set_u16(base + o::kSigmaMdeg, scaled(object.sigma_rad, 180000.0 / math::kPi, kWorst));
  image.set_u16(base + o::kQuality, object.quality_bits);
  image.set_u16(base + o::kQualityScore, object.quality_score);
  image.set_u16(base + o::kObjCode, number(object.accepted ? Code::ObjectFound : object.code));
  image.set_u32(base + o::kReasons, object.reasons);
}

std::size_t record_address(std::size_t object_i) noexcept {
  namespace f = registers::further_objects;
  return object_i == 0 ? registers::result::kRecordFirst
                       : f::kRecordFirst + f::kStride * (object_i - 1);
}

void encode_float_mirror(std::size_t object_i, std::uint16_t shown_no, const PoseRegisters& pose,
                         PoseFormat format, RegisterImage& image) noexcept {
  namespace m = registers::float_mirror;
  const std::size_t shift = m::kStride * object_i;
  image.set_u16(m::kFltNoBegin + shift, shown_no);
  image.set_u16(m::kFltNoEnd + shift, shown_no);
  const std::array<float, 7> reals = pose_reals(pose, format);
  for (std::size_t i = 0; i < reals.size(); ++i) {
    image.set_f32(m::kXMm + shift + 2 * i, reals[i]);
  }
}

void encode_object(std::size_t object_i, const PlcObject* object, bool valid, PoseFormat format,
                   std::uint16_t shown_no, RegisterImage& image) noexcept {
  const std::size_t base = record_address(object_i);
  if (object != nullptr) {
    encode_record(*object, format, base, image);
  } else {
    std::fill_n(image.data() + base, registers::object::kLength, std::uint16_t{0});
  }
  const bool has_pose = valid && object != nullptr && object->has_pose();
  const PoseRegisters pose = has_pose ? encode_pose(object->frame_from_grasp, format) : no_pose();
  encode_pose_registers(pose, base, image);
  encode_float_mirror(object_i, shown_no, pose, format, image);
  if (object_i > 0) {
    namespace f = registers::further_objects;
    image.set_u16(f::kObjNoBegin + f::kStride * (object_i - 1), shown_no);
    image.set_u16(f::kObjNoEnd + f::kStride * (object_i - 1), shown_no);
  }
}

}  // namespace

std::uint16_t result_register(std::uint64_t result_no) noexcept {
  return result_no == 0 ? std::uint16_t{0}
                        : static_cast<std::uint16_t>((result_no - 1) % 65535 + 1);
}

void encode_status(const PlcStatus& status, std::uint16_t flags, std::uint16_t ack_seq,
                   RegisterImage& image) noexcept {
  namespace s = registers::status;
  image.set_u16(s::kMapVersion, registers::kMapVersion);
  image.set_u16(s::kState, static_cast<std::uint16_t>(status.state));
  image.set_u16(s::kFlags, flags);
  image.set_u16(s::kHbOut, status.heartbeat);
  image.set_u16(s::kAckSeq, ack_seq);
  image.set_u16(s::kStatusCode, number(status.status_code));
  image.set_u16(s::kStatusDetail, status.status_detail);
  image.set_u16(s::kActivePreset, status.active_preset);
  image.set_u16(s::kPresetRev, status.preset_rev);
  image.set_u16(s::kErrCount, status.error_count);
  image.set_u32(s::kUptimeS, status.uptime_s);
  image.set_u32(s::kFrameCount, status.frame_count);
  image.set_u16(s::kBootId, status.boot_id);
  image.set_u16(s::kAckCode, number(status.ack_code));
  image.set_u16(s::kRecording, static_cast<std::uint16_t>(status.recording));
}

void encode_diagnostics(const PlcDiagnostics& d, const FieldBusCounters& counters,
                        RegisterImage& image) noexcept {
  namespace r = registers::diagnostics;
  image.set_u32(r::kFrames, d.frames);
  image.set_u32(r::kDroppedFrames, d.dropped_frames);
  image.set_u32(r::kLostPackets, d.lost_packets);
  image.set_u32(r::kReconnects, d.reconnects);
  image.set_u32(r::kJobs, d.jobs);
  image.set_u32(r::kJobsAccepted, d.jobs_accepted);
  image.set_u32(r::kJobsRejected, d.jobs_rejected);
  image.set_u32(r::kDeadlinesMissed, d.deadlines_missed);
  image.set_u32(r::kOverruns, d.overruns);
  image.set_u32(r::kHeapCalls, d.heap_calls);
  image.set_u32(r::kPageFaults, d.page_faults);
  image.set_u32(r::kClients, counters.clients);
  image.set_u32(r::kConnectionsRefused, counters.connections_refused);
  image.set_u32(r::kRequestsRefused, counters.requests_refused);
  image.set_u32(r::kExceptionsSent, counters.exceptions_sent);
  image.set_u32(r::kBytesDiscarded, counters.bytes_discarded);
  image.set_u32(r::kConfigReloads, d.config_reloads);
  image.set_u32(r::kConfigRefusals, d.config_refusals);
  image.set_i32(r::kBeltResidualUm, d.belt_residual_um);
  image.set_i32(r::kTilt, d.tilt_mdeg);
  image.set_u32(r::kSerialHash, d.serial_hash);
  image.set_u32(r::kBuildHash, d.build_hash);
  image.set_u32(r::kWorstJobUs, d.worst_job_us);
  image.set_u32(r::kRecordFrames, d.record_frames);
  image.set_u32(r::kRecordMissed, d.record_missed);
  image.set_u32(r::kRecordDropped, d.record_dropped);
  for (std::size_t i = 0; i < d.stage_us.size(); ++i) {
    image.set_u32(r::kStageUs + 2 * i, d.stage_us[i]);
  }
}

void encode_result(const PlcResult& result, std::uint64_t result_no, bool valid,
                   RegisterImage& image) noexcept {
  namespace r = registers::result;
  const bool present = result_no != 0;
  const std::uint16_t shown_no = result_register(result_no);
  const PlcResult none;
  const PlcResult& shown = present ? result : none;
  image.set_u16(r::kResNoBegin, shown_no);
  image.set_u16(r::kResNoEnd, shown_no);
  image.set_u16(r::kResCmdSeq, shown.cmd_seq);
  image.set_u16(r::kNFound, shown.found);
  image.set_u16(r::kNReported, static_cast<std::uint16_t>(shown.objects.size()));
  image.set_u32(r::kFrameId, shown.frame_id);
  image.set_u32(r::kEncCapture, shown.enc_capture);
  image.set_u32(r::kCaptureDelayUs, shown.capture_delay_us);
  image.set_u32(r::kAgeUs, shown.age_us);
  image.set_u32(r::kPartTag, shown.part_tag);
  image.set_u16(r::kResCode, present ? number(shown.code) : std::uint16_t{0});
  image.set_u16(r::kRetries, shown.retries);
  image.set_u32(r::kTTotalUs, shown.total_us);
  image.set_u16(r::kResPreset, shown.preset);
  image.set_u16(r::kResPresetRev, shown.preset_rev);
  image.set_u32(r::kResSeed, shown.seed);
  const PoseFormat format = is_pose_format(shown.pose_format)
                                ? static_cast<PoseFormat>(shown.pose_format)
                                : PoseFormat::IntrinsicZyx;
  for (std::size_t i = 0; i < kMaxObjects; ++i) {
    const PlcObject* object = i < shown.objects.size() ? &shown.objects[i] : nullptr;
    encode_object(i, object, valid, format, shown_no, image);
  }
}

void encode_probe(std::uint32_t counter, RegisterImage& image) noexcept {
  namespace p = registers::probe;
  image.set_u32(p::kProbeU32, 0x12345678u);
  image.set_i32(p::kProbeI32, -123456);
  image.set_f32(p::kProbeF32, 123456.0f);
  image.set_u16(p::kProbeAb, 0x4142);
  image.set_u32(p::kProbeCounter, counter);
}

}  // namespace grapnel
