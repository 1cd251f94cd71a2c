#pragma once

#include <stdexcept>
#include <string>

#include "drivers/modbus/modbus_server.h"
#include "tests/drivers/modbus/support/raw_client.h"
#include "tests/drivers/modbus/support/scripted_device.h"

namespace grapnel::test {

/// Loopback addresses with a role each: 127.0.0.1 and 127.0.0.3 control, 127.0.0.2 only reads, all
/// others are refused. Any free port.
inline ModbusConfig test_config() {
  ModbusConfig config;
  config.port = 0;
  config.control_peers = {"127.0.0.1", "127.0.0.3"};
  config.read_peers = {"127.0.0.2"};
  return config;
}

/// A server that moves only when the test turns it, on a clock that the test turns.
class HandDrivenServer {
 public:
  explicit HandDrivenServer(const ModbusConfig& config = test_config(), ModbusOptions options = {})
      : clock(1'000'000), server(config, device, clock, std::move(options)) {
    if (!server.open()) throw std::runtime_error(server.problem());
  }

  [[nodiscard]] RawClient connect(const std::string& source = "127.0.0.1") {
    RawClient client(server.port(), source);
    turn();
    return client;
  }
  /// Some rounds, enough for whatever loopback has delivered.
  void turn(int rounds = 3) {
    for (int i = 0; i < rounds; ++i) server.poll_once(0);
  }
  /// Turns the server until a whole answer came, or it closed, or 200 rounds passed.
  [[nodiscard]] Bytes wait(RawClient& client) {
    for (int i = 0; i < 200; ++i) {
      server.poll_once(1);
      Bytes answer = client.take_answer();
      if (!answer.empty() || client.closed_by_server()) return answer;
    }
    return {};
  }
  [[nodiscard]] Bytes ask(RawClient& client, const Bytes& adu) {
    client.send(adu);
    return wait(client);
  }
  /// PDU in, PDU out, unit 1.
  [[nodiscard]] Bytes ask_pdu(RawClient& client, const Bytes& pdu) {
    const Bytes answer = ask(client, make_adu(0x1234, 1, pdu));
    return answer.size() < 7 ? Bytes{} : Bytes(answer.begin() + 7, answer.end());
  }
  /// Register values of functions 3 or 4; empty on exceptions.
  [[nodiscard]] std::vector<std::uint16_t> read(RawClient& client, std::uint16_t first,
                                                std::uint16_t count, std::uint8_t function = 4) {
    const Bytes pdu = ask_pdu(client, {function, hi(first), lo(first), hi(count), lo(count)});
    std::vector<std::uint16_t> words;
    if (pdu.size() != 2u + 2u * count) return words;
    for (std::size_t i = 2; i < pdu.size(); i += 2) {
      words.push_back(static_cast<std::uint16_t>(pdu[i] << 8 | pdu[i + 1]));
    }
    return words;
  }
  /// Function 16; the answer PDU.
  Bytes write(RawClient& client, std::uint16_t first, const std::vector<std::uint16_t>& words) {
    Bytes pdu = {16,
                 hi(first),
                 lo(first),
                 0,
                 static_cast<std::uint8_t>(words.size()),
                 static_cast<std::uint8_t>(2 * words.size())};
    for (const std::uint16_t word : words) pdu = pdu + Bytes{hi(word), lo(word)};
    return ask_pdu(client, pdu);
  }
  /// Function 6; the answer PDU.
  Bytes write_one(RawClient& client, std::uint16_t address, std::uint16_t word) {
    return ask_pdu(client, {6, hi(address), lo(address), hi(word), lo(word)});
  }

  static std::uint8_t hi(std::uint16_t word) { return static_cast<std::uint8_t>(word >> 8); }
  static std::uint8_t lo(std::uint16_t word) { return static_cast<std::uint8_t>(word & 0xff); }

  ManualClock clock;
  ScriptedDevice device;
  ModbusServer server;
};

}  // namespace grapnel::test
