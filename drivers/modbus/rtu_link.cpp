#include "drivers/modbus/rtu_link.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>

#include <unistd.h>

#include "drivers/modbus/sockets.h"

namespace grapnel {
namespace {

constexpr PeerId kRtuPeer = 0xffff;
constexpr std::uint8_t kBroadcast = 0;
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kReopenUs = 1'000'000;
constexpr std::int64_t kOwnerSilenceUs = 10'000'000;

bool would_block() noexcept { return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR; }

}  // namespace

RtuLink::RtuLink(const ModbusConfig& config, RequestHandler& handler)
    : config_(config),
      handler_(&handler),
      silence_us_(config.rtu_silence_us != 0 ? config.rtu_silence_us
                                             : rtu_silence_us(config.rtu_baud)),
      frame_end_us_(kNever),
      owner_end_us_(kNever),
      reopen_us_(kNever) {}

RtuLink::~RtuLink() {
  if (line_ >= 0) close(line_);
}

bool RtuLink::open(std::string& problem) {
  if (config_.rtu_device.empty()) return true;
  if (!is_serial_rate(config_.rtu_baud)) {
    problem = "modbus: rtu_baud: " + std::to_string(config_.rtu_baud) +
              " is not allowed; a standard rate like 19200 is";
    return false;
  }
  line_ = open_serial(config_);
  if (line_ >= 0) return true;
  problem = "modbus: can't open " + config_.rtu_device + ": " + std::strerror(errno);
  return false;
}

pollfd RtuLink::poll_entry() const noexcept {
  const int out = out_end_ != out_begin_ ? POLLOUT : 0;
  return {line_, static_cast<short>(POLLIN | out), 0};
}

std::int64_t RtuLink::deadline_us() const noexcept {
  return std::min({frame_end_us_, owner_end_us_, reopen_us_});
}

void RtuLink::serve(short poll_result, std::int64_t now_us) noexcept {
  if (now_us >= reopen_us_) reopen(now_us);
  if (now_us >= owner_end_us_) {
    owner_end_us_ = kNever;
    handler_->command_block().release(kRtuPeer);
  }
  if (line_ < 0) return;
  const bool failed = (poll_result & (POLLERR | POLLHUP | POLLNVAL)) != 0;
  if (failed || ((poll_result & POLLIN) != 0 && !receive(now_us))) {
    lose_line(now_us);
    return;
  }
  if (now_us >= frame_end_us_) answer_frame(now_us);
  if (!send_answer()) lose_line(now_us);
}

void RtuLink::reopen(std::int64_t now_us) noexcept {
  line_ = open_serial(config_);
  reopen_us_ = line_ < 0 ? now_us + kReopenUs : kNever;
}

void RtuLink::lose_line(std::int64_t now_us) noexcept {
  close(line_);
  line_ = -1;
  handler_->counters().bytes_discarded += static_cast<std::uint32_t>(in_.size());
  in_ = RtuAssembler{};
  out_begin_ = out_end_ = 0;
  frame_end_us_ = kNever;
  owner_end_us_ = kNever;
  reopen_us_ = now_us + kReopenUs;
  handler_->command_block().release(kRtuPeer);
}

bool RtuLink::receive(std::int64_t now_us) noexcept {
  std::array<std::uint8_t, kMaxRtuFrame> bytes;
  const ssize_t count = read(line_, bytes.data(), bytes.size());
  if (count < 0) return would_block();
  if (count == 0) return true;
  in_.received(std::span(bytes).first(static_cast<std::size_t>(count)));
  frame_end_us_ = now_us + silence_us_;
  return true;
}

void RtuLink::answer_frame(std::int64_t now_us) noexcept {
  frame_end_us_ = kNever;
  const std::size_t received = in_.size();
  const std::span<const std::uint8_t> frame = in_.end_frame();
  if (frame.empty()) {
    handler_->counters().bytes_discarded += static_cast<std::uint32_t>(received);
    return;
  }
  const bool broadcast = frame[0] == kBroadcast;
  if (!broadcast && frame[0] != config_.rtu_slave_id) return;
  std::array<std::uint8_t, kMaxAduLength> adu{};
  std::array<std::uint8_t, kMaxAduLength> answer{};
  put_be16(adu, 4, static_cast<std::uint16_t>(frame.size()));
  std::copy(frame.begin(), frame.end(), adu.begin() + kMbapLength - 1);
  const Peer peer{kRtuPeer, PeerRole::Control, true};
  const std::size_t length =
      handler_->answer(peer, std::span(adu).first(kMbapLength - 1 + frame.size()), answer, now_us);
  const bool owns = handler_->command_block().owner() == kRtuPeer;
  owner_end_us_ = owns ? now_us + kOwnerSilenceUs : kNever;
  if (broadcast) return;
  const std::size_t body = length - (kMbapLength - 1);
  std::copy_n(answer.begin() + kMbapLength - 1, body, out_.begin());
  out_begin_ = 0;
  out_end_ = seal_rtu_frame(out_, body);
}

bool RtuLink::send_answer() noexcept {
  if (out_begin_ == out_end_) return true;
  const ssize_t sent = write(line_, out_.data() + out_begin_, out_end_ - out_begin_);
  if (sent < 0) return would_block();
  out_begin_ += static_cast<std::size_t>(sent);
  return true;
}

}  // namespace grapnel
