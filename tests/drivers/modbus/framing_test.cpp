// Telegrams byte by byte: what a raw client may send, and what comes back.
#include <gtest/gtest.h>

#include "tests/drivers/modbus/support/hand_driven_server.h"

namespace grapnel::test {
namespace {

const Bytes kReadProbe = {4, 0x03, 0x84, 0, 2};  // input 900, two registers
const Bytes kProbeAnswer = {4, 4, 0x12, 0x34, 0x56, 0x78};

Bytes exception(std::uint8_t function, std::uint8_t code) {
  return {static_cast<std::uint8_t>(function | 0x80), code};
}

TEST(ModbusFraming, AnswersWithTheRequestsTransactionAndUnit) {
  HandDrivenServer server;
  RawClient client = server.connect();
  for (const std::uint8_t unit : Bytes{0, 1, 255, 17}) {
    EXPECT_EQ(server.ask(client, make_adu(0xabcd, unit, kReadProbe)),
              make_adu(0xabcd, unit, kProbeAnswer));
  }
}

TEST(ModbusFraming, StrictModeRefusesForeignUnits) {
  ModbusConfig config = test_config();
  config.strict_unit_id = true;
  HandDrivenServer server(config);
  RawClient client = server.connect();
  EXPECT_EQ(server.ask(client, make_adu(1, 17, kReadProbe)), make_adu(1, 17, exception(4, 0x0b)));
  EXPECT_EQ(server.ask(client, make_adu(2, 255, kReadProbe)), make_adu(2, 255, kProbeAnswer));
}

TEST(ModbusFraming, ServesHoldingAndInputMirrorAlike) {
  HandDrivenServer server;
  RawClient client = server.connect();
  EXPECT_EQ(server.ask_pdu(client, {3, 0x03, 0x84, 0, 2}), (Bytes{3, 4, 0x12, 0x34, 0x56, 0x78}));
}

TEST(ModbusFraming, WritesAreEchoedAndCanBeReadBack) {
  HandDrivenServer server;
  RawClient client = server.connect();
  EXPECT_EQ(server.write_one(client, 31, 0xbeef), (Bytes{6, 0, 31, 0xbe, 0xef}));
  EXPECT_EQ(server.write(client, 8, {1, 2, 3}), (Bytes{16, 0, 8, 0, 3}));
  EXPECT_EQ(server.read(client, 8, 3, 3), (std::vector<std::uint16_t>{1, 2, 3}));
  EXPECT_EQ(server.read(client, 31, 1, 3), (std::vector<std::uint16_t>{0xbeef}));
}

TEST(ModbusFraming, ReadWriteWritesFirst) {
  HandDrivenServer server;
  RawClient client = server.connect();
  const Bytes answer = server.ask_pdu(client, {23, 0, 2, 0, 2, 0, 2, 0, 2, 4, 0, 5, 0, 6});
  EXPECT_EQ(answer, (Bytes{23, 4, 0, 5, 0, 6}));
}

TEST(ModbusFraming, FunctionsThatAreNotServedGetException1AtOnce) {
  HandDrivenServer server;
  RawClient client = server.connect();
  for (const int function : {0, 1, 2, 5, 7, 8, 11, 12, 15, 17, 20, 21, 22, 24, 0x63, 0x7f}) {
    const auto code = static_cast<std::uint8_t>(function);
    EXPECT_EQ(server.ask_pdu(client, {code, 0, 0, 0, 1}), exception(code, 1)) << function;
  }
  EXPECT_EQ(server.ask_pdu(client, {0x2b, 13, 1, 2, 3}), exception(0x2b, 1));
  EXPECT_EQ(server.ask_pdu(client, {0xff, 1}), exception(0xff, 1));
  EXPECT_EQ(server.ask_pdu(client, kReadProbe), kProbeAnswer);
}

TEST(ModbusFraming, CountsOutOfRangeGetException3) {
  HandDrivenServer server;
  RawClient client = server.connect();
  EXPECT_EQ(server.ask_pdu(client, {3, 0, 100, 0, 0}), exception(3, 3));
  EXPECT_EQ(server.ask_pdu(client, {3, 0, 100, 0, 126}), exception(3, 3));
  EXPECT_EQ(server.ask_pdu(client, {4, 0, 100, 0xff, 0xff}), exception(4, 3));
  EXPECT_EQ(server.ask_pdu(client, {16, 0, 0, 0, 0, 0}), exception(16, 3));
  EXPECT_EQ(server.ask_pdu(client, {16, 0, 0, 0, 2, 2, 0, 1}), exception(16, 3));
  EXPECT_EQ(server.ask_pdu(client, {16, 0, 0, 0, 1, 3, 0, 1, 2}), exception(16, 3));
  EXPECT_EQ(server.ask_pdu(client, {23, 0, 100, 0, 126, 0, 0, 0, 1, 2, 0, 1}), exception(23, 3));
  EXPECT_EQ(server.ask_pdu(client, {23, 0, 100, 0, 1, 0, 0, 0, 0, 0}), exception(23, 3));
  EXPECT_EQ(server.ask_pdu(client, {3, 0, 100, 0, 125}).size(), 2u + 250u);
}

TEST(ModbusFraming, AddressesOutsideTheMapGetException2) {
  HandDrivenServer server;
  RawClient client = server.connect();
  struct Range {
    std::uint8_t function;
    std::uint16_t first, count;
    bool ok;
  };
  const Range ranges[] = {{3, 0, 32, true},     {3, 0, 33, false},   {3, 31, 1, true},
                          {3, 32, 1, false},    {3, 99, 1, false},   {3, 99, 2, false},
                          {3, 100, 80, true},   {4, 0, 1, false},    {4, 99, 2, false},
                          {4, 100, 120, true},  {4, 480, 120, true}, {4, 911, 1, true},
                          {4, 911, 2, false},   {4, 912, 1, false},  {4, 65535, 1, false},
                          {3, 65535, 2, false}, {4, 800, 112, true}, {4, 800, 113, false}};
  for (const Range& range : ranges) {
    const Bytes answer = server.ask_pdu(
        client, {range.function, HandDrivenServer::hi(range.first),
                 HandDrivenServer::lo(range.first), 0, static_cast<std::uint8_t>(range.count)});
    if (range.ok) {
      EXPECT_EQ(answer.size(), 2u + 2u * range.count) << range.first << " " << range.count;
    } else {
      EXPECT_EQ(answer, exception(range.function, 2)) << range.first << " " << range.count;
    }
  }
}

TEST(ModbusFraming, OnlyTheCommandBlockCanBeWritten) {
  HandDrivenServer server;
  RawClient client = server.connect();
  for (const std::uint16_t address : std::vector<std::uint16_t>{32, 99, 100, 120, 911, 65535}) {
    EXPECT_EQ(server.write_one(client, address, 1), exception(6, 2)) << address;
    EXPECT_EQ(server.write(client, address, {1}), exception(16, 2)) << address;
  }
  EXPECT_EQ(server.write(client, 31, {1, 2}), exception(16, 2));
  EXPECT_EQ(server.ask_pdu(client, {23, 0, 100, 0, 1, 0, 31, 0, 2, 4, 0, 1, 0, 1}),
            exception(23, 2));
  EXPECT_EQ(server.ask_pdu(client, {23, 0, 40, 0, 1, 0, 0, 0, 1, 2, 0, 1}), exception(23, 2));
  EXPECT_TRUE(server.device.commands.empty());
}

TEST(ModbusFraming, GapsInsideTheMapReadZero) {
  HandDrivenServer server;
  RawClient client = server.connect();
  for (const std::uint16_t word : server.read(client, 480, 120)) EXPECT_EQ(word, 0);
  EXPECT_EQ(server.read(client, 828, 72), std::vector<std::uint16_t>(72, 0));
}

TEST(ModbusFraming, AWrongProtocolIdClosesTheConnection) {
  HandDrivenServer server;
  RawClient client = server.connect();
  EXPECT_TRUE(server.ask(client, {0, 1, 0, 1}).empty());
  EXPECT_TRUE(client.closed_by_server());
  EXPECT_EQ(server.server.counters().bytes_discarded, 4u);
}

TEST(ModbusFraming, AnImpossibleLengthClosesTheConnection) {
  for (const Bytes& head :
       {Bytes{0, 1, 0, 0, 0, 0}, Bytes{0, 1, 0, 0, 0, 1, 1}, Bytes{0, 1, 0, 0, 0, 255, 1},
        Bytes{0, 1, 0, 0, 1, 0, 1}, Bytes{0, 1, 0, 0, 0xff, 0xff}}) {
    HandDrivenServer server;
    RawClient client = server.connect();
    EXPECT_TRUE(server.ask(client, head).empty());
    EXPECT_TRUE(client.closed_by_server());
  }
}

TEST(ModbusFraming, ALengthThatDoesNotFitTheFunctionClosesTheConnection) {
  for (const Bytes& pdu :
       {Bytes{4}, Bytes{4, 0, 100, 0}, Bytes{4, 0, 100, 0, 1, 0}, Bytes{6, 0, 0, 0, 1, 0, 0},
        Bytes{16, 0, 0, 0, 1}, Bytes{16, 0, 0, 0, 1, 2, 0, 1, 9}, Bytes{16, 0, 0, 0, 1, 200, 0, 1},
        Bytes{23, 0, 100, 0, 1, 0, 0, 0, 1, 4, 0, 1}, Bytes{0x2b, 14, 1}, Bytes{0x2b}}) {
    HandDrivenServer server;
    RawClient client = server.connect();
    EXPECT_TRUE(server.ask(client, make_adu(1, 1, pdu)).empty());
    EXPECT_TRUE(client.closed_by_server()) << static_cast<int>(pdu[0]) << " " << pdu.size();
    EXPECT_TRUE(server.device.commands.empty());
  }
}

TEST(ModbusFraming, GarbageClosesOnlyItsOwnConnection) {
  HandDrivenServer server;
  RawClient good = server.connect();
  RawClient bad = server.connect();
  const std::string text = "GET / HTTP/1.1\r\nHost: robot\r\n\r\n";
  EXPECT_TRUE(server.ask(bad, Bytes(text.begin(), text.end())).empty());
  EXPECT_TRUE(bad.closed_by_server());
  EXPECT_EQ(server.ask_pdu(good, kReadProbe), kProbeAnswer);
}

TEST(ModbusFraming, PipelinedRequestsAreAnsweredInOrder) {
  HandDrivenServer server;
  RawClient client = server.connect();
  Bytes stream;
  for (std::uint16_t i = 0; i < 40; ++i) stream = stream + make_adu(i, 1, kReadProbe);
  client.send(stream);
  for (std::uint16_t i = 0; i < 40; ++i) {
    EXPECT_EQ(server.wait(client), make_adu(i, 1, kProbeAnswer)) << i;
  }
}

TEST(ModbusFraming, AGoodRequestAfterABadOneInOnePacketIsServed) {
  HandDrivenServer server;
  RawClient client = server.connect();
  client.send(make_adu(1, 1, {3, 0, 100, 0, 0}) + make_adu(2, 1, {0x63}) +
              make_adu(3, 1, kReadProbe));
  EXPECT_EQ(server.wait(client), make_adu(1, 1, exception(3, 3)));
  EXPECT_EQ(server.wait(client), make_adu(2, 1, exception(0x63, 1)));
  EXPECT_EQ(server.wait(client), make_adu(3, 1, kProbeAnswer));
}

TEST(ModbusFraming, ARequestTornAtEveryPlaceIsServed) {
  HandDrivenServer server;
  RawClient client = server.connect();
  const Bytes adu = make_adu(9, 1, kReadProbe);
  for (std::size_t cut = 1; cut < adu.size(); ++cut) {
    const auto middle = adu.begin() + static_cast<std::ptrdiff_t>(cut);
    client.send(Bytes(adu.begin(), middle));
    server.turn();
    EXPECT_TRUE(client.take_answer().empty());
    EXPECT_EQ(server.ask(client, Bytes(middle, adu.end())), make_adu(9, 1, kProbeAnswer)) << cut;
  }
}

TEST(ModbusFraming, TheLongestRequestsAreServed) {
  HandDrivenServer server;
  RawClient client = server.connect();
  // 123 registers fit the protocol but not the map: still an orderly exception.
  Bytes pdu = {16, 0, 0, 0, 123, 246};
  pdu.resize(6 + 246);
  EXPECT_EQ(server.ask_pdu(client, pdu), exception(16, 2));
  // The longest frame of all: an unknown function with 252 bytes.
  Bytes longest(253, 0);
  longest[0] = 0x41;
  EXPECT_EQ(server.ask_pdu(client, longest), exception(0x41, 1));
}

TEST(ModbusFraming, AClientThatOnlyShutsItsSendingSideStillGetsItsAnswer) {
  HandDrivenServer server;
  RawClient client = server.connect();
  client.send(make_adu(1, 1, kReadProbe));
  client.shut_sending();
  EXPECT_EQ(server.wait(client), make_adu(1, 1, kProbeAnswer));
  server.turn();
  client.receive();
  EXPECT_TRUE(client.closed_by_server());
}

TEST(ModbusFraming, CountsExceptionsAndShowsThemInTheDiagnostics) {
  HandDrivenServer server;
  RawClient client = server.connect();
  EXPECT_EQ(server.ask_pdu(client, {0x63}), exception(0x63, 1));
  EXPECT_EQ(server.ask_pdu(client, {4, 0, 0, 0, 1}), exception(4, 2));
  EXPECT_EQ(server.read(client, 628, 2), (std::vector<std::uint16_t>{0, 2}));
  EXPECT_EQ(server.read(client, 622, 2), (std::vector<std::uint16_t>{0, 1}));
}

TEST(ModbusIdentification, AnswersBasicAndRegularObjects) {
  ModbusOptions options;
  options.identity.vendor = "V";
  options.identity.product_code = "PC";
  options.identity.revision = "1.2";
  options.identity.product_name = "name";
  HandDrivenServer server(test_config(), options);
  RawClient client = server.connect();
  EXPECT_EQ(server.ask_pdu(client, {0x2b, 14, 1, 0}),
            (Bytes{0x2b, 14, 1, 0x82, 0, 0, 3, 0, 1, 'V', 1, 2, 'P', 'C', 2, 3, '1', '.', '2'}));
  EXPECT_EQ(server.ask_pdu(client, {0x2b, 14, 2, 3}),
            (Bytes{0x2b, 14, 2, 0x82, 0, 0, 4, 3, 0, 4, 4, 'n', 'a', 'm', 'e', 5, 0, 6, 0}));
  EXPECT_EQ(server.ask_pdu(client, {0x2b, 14, 4, 1}),
            (Bytes{0x2b, 14, 4, 0x82, 0, 0, 1, 1, 2, 'P', 'C'}));
  EXPECT_EQ(server.ask_pdu(client, {0x2b, 14, 4, 7}), exception(0x2b, 2));
  EXPECT_EQ(server.ask_pdu(client, {0x2b, 14, 5, 0}), exception(0x2b, 3));
}

TEST(ModbusIdentification, LeavesWhatDoesNotFitToTheNextRequest) {
  ModbusOptions options;
  options.identity = {std::string(60, 'a'),
                      std::string(60, 'b'),
                      std::string(60, 'c'),
                      std::string(60, 'd'),
                      std::string(99, 'e'),
                      "",
                      ""};
  HandDrivenServer server(test_config(), options);
  RawClient client = server.connect();
  const Bytes first = server.ask_pdu(client, {0x2b, 14, 2, 0});
  ASSERT_GE(first.size(), 7u);
  EXPECT_LE(first.size(), 253u);
  EXPECT_EQ(first[4], 0xff);
  EXPECT_EQ(first[5], 3);
  const Bytes rest = server.ask_pdu(client, {0x2b, 14, 2, first[5]});
  EXPECT_EQ(rest[4], 0);
  EXPECT_EQ(rest[6], 4);
  EXPECT_EQ(rest.size(), 7u + 2 + 60 + 2 + 60 + 2 + 2);
}

}  // namespace
}  // namespace grapnel::test
