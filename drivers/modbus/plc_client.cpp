#include "drivers/modbus/plc_client.h"

#include <algorithm>
#include <cerrno>

#include "drivers/modbus/register_decoder.h"

namespace grapnel {
namespace {

namespace c = registers::command;
namespace f = registers::further_objects;
namespace r = registers::result;

constexpr std::uint16_t kCycleCount = r::kLast - registers::status::kFirst + 1;  // 80
constexpr std::int64_t kPollUs = 2000;
constexpr std::int64_t kBeatUs = 100'000;
constexpr int kBracketTries = 100;
constexpr std::uint16_t kCommandWords = c::kHbIn;  // the heartbeat is written by itself

}  // namespace

PlcClient::PlcClient(const PlcClientOptions& options) : options_(options) {}

Status PlcClient::fail(const char* what) {
  const int reason = errno;
  problem_ = options_.host + ":" + std::to_string(options_.port) + ": can't " + what + ": " +
             modbus_strerror(reason);
  return Error{Code::InternalFault, Stage::FieldBus, reason};
}

Status PlcClient::connect() {
  context_.reset(modbus_new_tcp_pi(options_.host.c_str(), std::to_string(options_.port).c_str()));
  if (context_ == nullptr) return fail("make a client");
  modbus_set_slave(context_.get(), options_.unit_id);
  modbus_set_response_timeout(
      context_.get(), static_cast<std::uint32_t>(options_.response_timeout_ms / 1000),
      static_cast<std::uint32_t>(options_.response_timeout_ms % 1000 * 1000));
  if (modbus_connect(context_.get()) != 0) {
    const Status failed = fail("connect");
    context_.reset();
    return failed;
  }
  return {};
}

void PlcClient::disconnect() noexcept { context_.reset(); }

Status PlcClient::read_input(std::uint16_t first, std::uint16_t count, std::uint16_t* words) {
  if (context_ == nullptr) return fail("read: not connected");
  return modbus_read_input_registers(context_.get(), first, count, words) == count
             ? Status{}
             : fail("read input registers");
}

Status PlcClient::read_holding(std::uint16_t first, std::uint16_t count, std::uint16_t* words) {
  if (context_ == nullptr) return fail("read: not connected");
  return modbus_read_registers(context_.get(), first, count, words) == count
             ? Status{}
             : fail("read holding registers");
}

Status PlcClient::write(std::uint16_t first, std::uint16_t count, const std::uint16_t* words) {
  if (context_ == nullptr) return fail("write: not connected");
  if (options_.single_writes) {
    // The first register, which may be CMD_SEQ, comes last.
    for (int i = count - 1; i >= 0; --i) {
      if (modbus_write_register(context_.get(), first + i, words[i]) != 1) {
        return fail("write a register");
      }
    }
    return {};
  }
  return modbus_write_registers(context_.get(), first, count, words) == count
             ? Status{}
             : fail("write registers");
}

Status PlcClient::read(PlcReading& reading) {
  for (int i = 0; i < kBracketTries; ++i) {
    RegisterImage image(options_.word_order);
    const Status got = read_input(registers::status::kFirst, kCycleCount,
                                  image.data() + registers::status::kFirst);
    if (!got) return got;
    reading.status = decode_status(image);
    reading.result_no = image.u16(r::kResNoBegin);
    reading.result = decode_result_head(image);
    reading.poses.fill(no_pose());
    const std::size_t reported = std::min<std::size_t>(image.u16(r::kNReported), kMaxObjects);
    reading.result.objects.resize(reported);
    if (reported > 0) {
      reading.result.objects[0] = decode_object(image, r::kRecordFirst);
      reading.poses[0] = decode_pose_registers(image, r::kRecordFirst);
    }
    bool whole = reading.result_no == image.u16(r::kResNoEnd);
    const Status rest = read_further_objects(reading.result_no, reading, whole);
    if (!rest || whole) return rest;
  }
  problem_ = options_.host + ": the result changes faster than it can be read";
  return Error{Code::Busy, Stage::FieldBus, 0};
}

Status PlcClient::read_further_objects(std::uint16_t result_no, PlcReading& reading, bool& whole) {
  for (std::size_t i = 1; i < reading.result.objects.size() && whole; ++i) {
    const std::size_t shift = f::kStride * (i - 1);
    RegisterImage image(options_.word_order);
    const Status got = read_input(static_cast<std::uint16_t>(f::kFirst + shift), f::kStride,
                                  image.data() + f::kFirst + shift);
    if (!got) return got;
    whole = image.u16(f::kObjNoBegin + shift) == result_no &&
            image.u16(f::kObjNoEnd + shift) == result_no;
    reading.result.objects[i] = decode_object(image, f::kRecordFirst + shift);
    reading.poses[i] = decode_pose_registers(image, f::kRecordFirst + shift);
  }
  return {};
}

Status PlcClient::write_command(const PlcCommand& command) {
  RegisterImage image(options_.word_order);
  encode_command(command, image);
  return write(c::kCmdSeq, kCommandWords, image.data());
}

Status PlcClient::take_token(PlcCommand& command) {
  std::uint16_t held_seq = 0;
  const Status held = read_holding(c::kCmdSeq, 1, &held_seq);
  if (held) command.seq = static_cast<std::uint16_t>(held_seq % 65535 + 1);
  return held;
}

Status PlcClient::send(PlcCommand& command) {
  const Status token = take_token(command);
  return token ? write_command(command) : token;
}

Result<PlcAnswer> PlcClient::run(PlcCommand command, int timeout_ms, bool wait_done) {
  const Status token = take_token(command);
  if (!token) return token.error();
  PlcAnswer answer;
  const Status before = read(answer.reading);
  if (!before) return before.error();
  const std::uint16_t boot_id = answer.reading.status.boot_id;
  const std::int64_t start_us = clock_.now_us();
  const Status written = write_command(command);
  if (!written) return written.error();
  while (clock_.now_us() - start_us < timeout_ms * std::int64_t{1000}) {
    const Status beat = beat_if_due();
    if (!beat) return beat.error();
    const Status got = read(answer.reading);
    if (!got) return got.error();
    const PlcStatus& status = answer.reading.status;
    if (status.boot_id != boot_id) {
      problem_ = options_.host + ": the device restarted";
      return Error{Code::Aborted, Stage::FieldBus, 0};
    }
    if (status.ack_seq == command.seq) {
      answer.ack_code = status.ack_code;
      answer.latency_us = clock_.now_us() - start_us;
      answer.done = (status.flags & kFlagDone) != 0 && answer.reading.result.cmd_seq == command.seq;
      if (answer.ack_code != Code::Accepted || !wait_done || answer.done) return answer;
    }
    clock_.sleep_until_us(clock_.now_us() + kPollUs);
  }
  problem_ = options_.host + ": no answer to command " + std::to_string(command.code) + " in " +
             std::to_string(timeout_ms) + " ms";
  return Error{Code::NoFrameInTime, Stage::FieldBus, command.code};
}

Status PlcClient::beat_if_due() {
  const std::int64_t now_us = clock_.now_us();
  if (options_.heartbeat_limit_ms == 0 || now_us < next_beat_us_) return {};
  next_beat_us_ = now_us + kBeatUs;
  const std::uint16_t words[] = {++beat_, options_.heartbeat_limit_ms};
  return write(c::kHbIn, 2, words);
}

}  // namespace grapnel
