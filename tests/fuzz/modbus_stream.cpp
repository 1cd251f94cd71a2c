#include "tests/fuzz/modbus_stream.h"

#include <algorithm>
#include <array>

#include "base/assert.h"
#include "drivers/modbus/adu_assembler.h"
#include "drivers/modbus/request_handler.h"
#include "drivers/modbus/rtu_framing.h"

namespace grapnel::test {
namespace {

class CountingSink final : public PlcCommandSink {
 public:
  Code on_command(const PlcCommand& command) noexcept override {
    GRAPNEL_ASSERT(command.seq != 0);
    ++commands;
    status.ack_seq = command.seq;
    return command.code == 20 ? Code::Accepted : Code::UnknownCommand;
  }
  void on_heartbeat_lost(bool) noexcept override {}
  void on_control_lost() noexcept override {}
  void read_status(PlcStatus& out) noexcept override { out = status; }
  void read_result(PlcResult& out) noexcept override { out = PlcResult{}; }

  PlcStatus status;
  int commands = 0;
};

void check_answer(std::span<const std::uint8_t> adu, std::span<const std::uint8_t> answer) {
  GRAPNEL_ASSERT(answer.size() >= kMbapLength + 2 && answer.size() <= kMaxAduLength);
  GRAPNEL_ASSERT(be16(answer, 0) == be16(adu, 0) && be16(answer, 2) == 0 && answer[6] == adu[6]);
  GRAPNEL_ASSERT(be16(answer, 4) == answer.size() - 6);
  const bool exception = answer[7] == (adu[7] | 0x80);
  GRAPNEL_ASSERT(exception || answer[7] == adu[7]);
  GRAPNEL_ASSERT(!exception || answer.size() == kMbapLength + 2);
}

void check_image(const RegisterImage& image) {
  GRAPNEL_ASSERT(image.u16(registers::status::kMapVersion) == registers::kMapVersion);
  GRAPNEL_ASSERT(image.u32(registers::probe::kProbeU32) == 0x12345678u);
  for (std::size_t address = registers::command::kLast + 1; address < registers::kFirstReadOnly;
       ++address) {
    GRAPNEL_ASSERT(image.u16(address) == 0);
  }
}

}  // namespace

std::size_t run_modbus_stream(std::span<const std::uint8_t> input) {
  if (input.empty()) return 0;
  const std::uint8_t choice = input[0];
  input = input.subspan(1);
  ModbusConfig config;
  config.strict_unit_id = (choice & 1) != 0;
  const Peer peer{1, (choice & 2) != 0 ? PeerRole::Control : PeerRole::Read, false};
  const std::size_t piece = 1 + static_cast<std::size_t>(choice >> 2) * 5;
  CountingSink sink;
  RequestHandler handler(config, DeviceIdentity{}, sink);
  GRAPNEL_ASSERT(handler.open(0).ok());
  AduAssembler assembler;
  std::size_t answered = 0;
  while (!input.empty()) {
    const std::span<std::uint8_t> room = assembler.room();
    const std::size_t count = std::min({piece, room.size(), input.size()});
    std::copy_n(input.begin(), count, room.begin());
    assembler.received(count);
    input = input.subspan(count);
    std::span<const std::uint8_t> adu;
    AduAssembler::Next next = assembler.next(adu);
    for (; next == AduAssembler::Next::Ready; next = assembler.next(adu)) {
      std::array<std::uint8_t, kMaxAduLength> answer{};
      const std::size_t length = handler.answer(peer, adu, answer, 0);
      check_answer(adu, std::span(answer).first(length));
      assembler.consume(adu.size());
      ++answered;
    }
    if (next == AduAssembler::Next::Malformed) break;
    GRAPNEL_ASSERT(assembler.has_room());
  }
  handler.refresh(0);
  check_image(handler.image());
  GRAPNEL_ASSERT(peer.role == PeerRole::Control || sink.commands == 0);
  return answered;
}

void run_rtu_stream(std::span<const std::uint8_t> input) {
  RtuAssembler assembler;
  while (!input.empty()) {
    const std::size_t count = std::min<std::size_t>(input.size(), 1 + input[0] % 64u);
    assembler.received(input.first(count));
    input = input.subspan(count);
    if (count % 3 != 0) continue;
    const std::span<const std::uint8_t> frame = assembler.end_frame();
    GRAPNEL_ASSERT(frame.size() <= kMaxRtuFrame - 2 && assembler.size() == 0);
  }
}

}  // namespace grapnel::test
