#include "drivers/modbus/request_handler.h"

#include <algorithm>

namespace grapnel {
namespace {

constexpr std::int64_t kProbePeriodUs = 100'000;

// MBAP of an answer: the request's, with the length of what follows.
void put_head(std::span<const std::uint8_t> adu, std::size_t pdu_length,
              std::span<std::uint8_t> out) noexcept {
  std::copy_n(adu.begin(), kMbapLength, out.begin());
  put_be16(out, 4, static_cast<std::uint16_t>(pdu_length + 1));
}

}  // namespace

RequestHandler::RequestHandler(const ModbusConfig& config, const DeviceIdentity& identity,
                               PlcCommandSink& sink)
    : image_(config.word_order),
      identity_(identity),
      sink_(&sink),
      command_block_(image_, sink),
      engine_(image_),
      strict_unit_(config.strict_unit_id) {
  for (const double unit : config.unit_ids) {
    if (unit >= 0.0 && unit <= 255.0) unit_known_[static_cast<std::size_t>(unit)] = true;
  }
}

Status RequestHandler::open(std::int64_t now_us) {
  start_us_ = now_us;
  const Status opened = engine_.open();
  if (!opened) return opened;
  encode_result(result_, 0, false, image_);
  refresh(now_us);
  return {};
}

std::size_t RequestHandler::answer(const Peer& peer, std::span<const std::uint8_t> adu,
                                   std::span<std::uint8_t> out, std::int64_t now_us) noexcept {
  ++counters_.requests;
  PduRequest request;
  const ModbusException exception = check(peer, adu, request);
  if (exception != ModbusException::None) return refuse(adu, exception, out);
  if (request.writes()) command_block_.take(peer.id);
  refresh(now_us);
  const std::size_t length = serve(request, adu, out, now_us);
  return length != 0 ? length : refuse(adu, ModbusException::DeviceFailure, out);
}

ModbusException RequestHandler::check(const Peer& peer, std::span<const std::uint8_t> adu,
                                      PduRequest& request) noexcept {
  if (strict_unit_ && !peer.any_unit && !unit_known_[adu[6]]) return ModbusException::NoSuchUnit;
  const ModbusException malformed = parse_request(adu.subspan(kMbapLength), request);
  if (malformed != ModbusException::None) return malformed;
  const bool may_write = peer.role == PeerRole::Control && command_block_.may_take(peer.id);
  if (request.writes() && !may_write) {
    ++counters_.requests_refused;
    return ModbusException::IllegalFunction;
  }
  return check_addresses(request);
}

std::size_t RequestHandler::serve(const PduRequest& request, std::span<const std::uint8_t> adu,
                                  std::span<std::uint8_t> out, std::int64_t now_us) noexcept {
  if (request.function == ModbusFunction::EncapsulatedTransport) return identify(adu, out);
  if (request.function == ModbusFunction::ReadWrite) {
    return write_then_read(request, adu, out, now_us);
  }
  const std::size_t length = engine_.answer(adu, out);
  if (request.writes()) after_write(request, now_us);
  return length;
}

// Function 23 as its two halves, so that the read half already shows the answer to the command that
// the write half brought.
std::size_t RequestHandler::write_then_read(const PduRequest& request,
                                            std::span<const std::uint8_t> adu,
                                            std::span<std::uint8_t> out,
                                            std::int64_t now_us) noexcept {
  std::array<std::uint8_t, kMaxAduLength> half{};
  const std::size_t write_pdu = 6 + request.write_data.size();
  put_head(adu, write_pdu, half);
  const std::span<std::uint8_t> pdu = std::span(half).subspan(kMbapLength);
  pdu[0] = static_cast<std::uint8_t>(ModbusFunction::WriteMultiple);
  put_be16(pdu, 1, request.write_first);
  put_be16(pdu, 3, request.write_count);
  pdu[5] = static_cast<std::uint8_t>(request.write_data.size());
  std::copy(request.write_data.begin(), request.write_data.end(), pdu.begin() + 6);
  if (engine_.answer(std::span(half).first(kMbapLength + write_pdu), out) == 0) return 0;
  after_write(request, now_us);
  refresh(now_us);
  put_head(adu, 5, half);
  pdu[0] = static_cast<std::uint8_t>(ModbusFunction::ReadHolding);
  put_be16(pdu, 1, request.read_first);
  put_be16(pdu, 3, request.read_count);
  const std::size_t length = engine_.answer(std::span(half).first(kMbapLength + 5), out);
  if (length != 0) out[kMbapLength] = static_cast<std::uint8_t>(ModbusFunction::ReadWrite);
  return length;
}

std::size_t RequestHandler::identify(std::span<const std::uint8_t> adu,
                                     std::span<std::uint8_t> out) noexcept {
  ModbusException exception = ModbusException::None;
  const std::size_t length = answer_identification(adu.subspan(kMbapLength), identity_,
                                                   out.subspan(kMbapLength), exception);
  if (length == 0) return refuse(adu, exception, out);
  put_head(adu, length, out);
  return kMbapLength + length;
}

std::size_t RequestHandler::refuse(std::span<const std::uint8_t> adu, ModbusException exception,
                                   std::span<std::uint8_t> out) noexcept {
  ++counters_.exceptions_sent;
  put_head(adu, 2, out);
  out[kMbapLength] = static_cast<std::uint8_t>(adu[kMbapLength] | 0x80);
  out[kMbapLength + 1] = static_cast<std::uint8_t>(exception);
  return kMbapLength + 2;
}

void RequestHandler::after_write(const PduRequest& request, std::int64_t now_us) noexcept {
  constexpr unsigned kEncoder = registers::command::kEncTrigger;
  const bool encoder_alone = request.write_first == kEncoder && request.write_count == 2;
  if (!command_block_.after_write(now_us, encoder_alone)) return;
  const std::uint32_t clients = counters_.clients;
  counters_ = FieldBusCounters{};
  counters_.clients = clients;
}

void RequestHandler::refresh(std::int64_t now_us) noexcept {
  sink_->read_status(status_);
  std::uint16_t flags = status_.flags;
  if (command_block_.heartbeat_lost()) {
    flags =
        static_cast<std::uint16_t>((flags & ~(kFlagReady | kFlagResultValid)) | kFlagHeartbeatLost);
  }
  const bool new_result = status_.result_no != shown_result_no_;
  if (new_result && status_.result_no != 0) sink_->read_result(result_);
  const bool has_pose =
      status_.result_no != 0 && !result_.objects.empty() && result_.objects[0].has_pose();
  const bool valid = (flags & kFlagResultValid) != 0 && has_pose;
  if (!valid) flags = static_cast<std::uint16_t>(flags & ~kFlagResultValid);
  flags = static_cast<std::uint16_t>(flags & ~kFlagHeartbeat);
  if ((status_.heartbeat & 1) != 0) flags = static_cast<std::uint16_t>(flags | kFlagHeartbeat);
  if (new_result || valid != shown_valid_) {
    encode_result(result_, status_.result_no, valid, image_);
    shown_result_no_ = status_.result_no;
    shown_valid_ = valid;
  }
  encode_status(status_, flags, command_block_.acknowledged(status_.ack_seq), image_);
  encode_diagnostics(status_.diagnostics, counters_, image_);
  encode_probe(static_cast<std::uint32_t>((now_us - start_us_) / kProbePeriodUs), image_);
}

}  // namespace grapnel
