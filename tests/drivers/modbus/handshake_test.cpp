// The command token in both styles, heartbeats, and who owns the command block.
#include <gtest/gtest.h>

#include "tests/drivers/modbus/support/hand_driven_server.h"

namespace grapnel::test {
namespace {

constexpr std::uint16_t kAckSeq = 104;
constexpr std::uint16_t kFlags = 102;

class Handshake : public testing::Test {
 protected:
  Handshake() { server.device.result.objects.push_back(accepted_object()); }

  std::uint16_t reg(RawClient& client, std::uint16_t address) {
    const auto words = server.read(client, address, 1);
    return words.empty() ? std::uint16_t{0xdead} : words[0];
  }

  HandDrivenServer server;
  RawClient plc = server.connect();
};

TEST_F(Handshake, OneWriteCarriesCommandAndParameters) {
  server.clock.advance_us(777);
  server.write(plc, 0, {9,      20, 2, 3, 4, 5, 6, 7, 0x0001, 0x0002, 0xaaaa, 0xbbbb, 0xffff,
                        0xfff6, 0,  1, 0, 2, 0, 3, 0, 4,      0,      5,      0,      6});
  ASSERT_EQ(server.device.commands.size(), 1u);
  const PlcCommand& command = server.device.commands[0];
  EXPECT_EQ(command.seq, 9);
  EXPECT_EQ(command.code, 20);
  EXPECT_EQ(command.preset_id, 2);
  EXPECT_EQ(command.model_id, 3);
  EXPECT_EQ(command.max_objects, 4);
  EXPECT_EQ(command.options, 5);
  EXPECT_EQ(command.timeout_ms, 6);
  EXPECT_EQ(command.pose_format, 7);
  EXPECT_EQ(command.enc_trigger, 0x00010002u);
  EXPECT_EQ(command.part_tag, 0xaaaabbbbu);
  EXPECT_EQ(command.robot_pose[0], -10);
  EXPECT_EQ(command.robot_pose[6], 6);
  EXPECT_EQ(command.accepted_us, server.clock.now_us());
}

TEST_F(Handshake, CountingStyleRunsEachNumberOnce) {
  for (std::uint16_t token = 1; token <= 5; ++token) {
    server.write(plc, 0, {token, 20});
    EXPECT_EQ(reg(plc, kAckSeq), token);
    EXPECT_EQ(reg(plc, 121), token);  // RES_CMD_SEQ
    server.write(plc, 0, {token, 20});
  }
  EXPECT_EQ(server.device.commands.size(), 5u);
}

TEST_F(Handshake, CountingWrapsFrom65535To1) {
  server.write(plc, 0, {65535, 20});
  server.write(plc, 0, {1, 20});
  EXPECT_EQ(server.device.commands.size(), 2u);
}

TEST_F(Handshake, FourPhaseStyleUsesOnly0And1) {
  for (int cycle = 1; cycle <= 3; ++cycle) {
    server.write(plc, 0, {1, 20});
    EXPECT_EQ(reg(plc, kAckSeq), 1);
    EXPECT_NE(reg(plc, kFlags) & kFlagDone, 0);
    EXPECT_EQ(reg(plc, 120), cycle);
    server.write(plc, 0, {0});
    EXPECT_EQ(reg(plc, kAckSeq), 0);
    EXPECT_EQ(reg(plc, 120), cycle) << "the result stays";
    EXPECT_EQ(server.device.commands.size(), static_cast<std::size_t>(cycle));
  }
}

TEST_F(Handshake, AClientWithFunction6WritesTheTokenLast) {
  server.write_one(plc, 2, 11);
  server.write_one(plc, 1, 40);
  EXPECT_TRUE(server.device.commands.empty());
  server.write_one(plc, 0, 1);
  ASSERT_EQ(server.device.commands.size(), 1u);
  EXPECT_EQ(server.device.commands[0].code, 40);
  EXPECT_EQ(server.device.commands[0].preset_id, 11);
}

TEST_F(Handshake, AReconnectWithTheSameTokenRunsNothing) {
  server.write(plc, 0, {5, 20});
  plc.close();
  server.turn();
  RawClient again = server.connect();
  server.write(again, 0, {5, 20});
  EXPECT_EQ(server.device.commands.size(), 1u);
  EXPECT_EQ(reg(again, kAckSeq), 5);
}

TEST_F(Handshake, ARefusedCommandIsAcknowledgedWithItsCode) {
  server.write(plc, 0, {1, 20});
  server.device.answer = Code::Busy;
  server.write(plc, 0, {2, 20});
  EXPECT_EQ(reg(plc, kAckSeq), 2);
  EXPECT_EQ(reg(plc, 115), 3002);
  EXPECT_EQ(reg(plc, 121), 1) << "the result of the first command stays";
  EXPECT_EQ(server.read(plc, 138, 2), (std::vector<std::uint16_t>{0x0001, 0xe240}));
}

TEST_F(Handshake, EncoderCountsInWritesOfTheirOwnAreAStream) {
  server.write(plc, 8, {1, 2});
  EXPECT_TRUE(server.device.commands.empty());
  server.write(plc, 0, {1, 20, 0, 0, 0, 0, 0, 0, 1, 3});  // with a token: the part sensor's count
  server.write(plc, 8, {1, 4});
  server.write(plc, 8, {1});  // half a count is none
  server.write(plc, 26, {1});
  EXPECT_EQ(server.device.encoder_counts, (std::vector<std::uint32_t>{0x10002, 0x10004}));
  ASSERT_EQ(server.device.commands.size(), 1u);
  EXPECT_EQ(server.device.commands[0].enc_trigger, 0x10003u);
}

TEST_F(Handshake, ALatchedCountThatIsWrittenOverAndOverIsNoStream) {
  // A block written every cycle, and parameters written before their token, hold the part sensor's
  // count: beside the next part's it would make a place between the two parts.
  for (int cycle = 0; cycle < 3; ++cycle) {
    server.write(plc, 0, {0, 20, 0, 0, 0, 0, 0, 0, 1, 3});
  }
  server.write(plc, 1, {20, 0, 0, 0, 0, 0, 0, 2, 5});
  server.write(plc, 0, {1});
  for (int cycle = 0; cycle < 3; ++cycle) {
    server.write(plc, 0, {1, 20, 0, 0, 0, 0, 0, 0, 2, 5});
  }
  EXPECT_TRUE(server.device.encoder_counts.empty());
  ASSERT_EQ(server.device.commands.size(), 1u);
  EXPECT_EQ(server.device.commands[0].enc_trigger, 0x20005u);
}

TEST_F(Handshake, Function23AnswersWithTheAcknowledgement) {
  // Writes token and code, reads 100…121 in the same telegram.
  const Bytes answer = server.ask_pdu(plc, {23, 0, 100, 0, 22, 0, 0, 0, 2, 4, 0, 7, 0, 20});
  ASSERT_EQ(answer.size(), 2u + 44u);
  EXPECT_EQ(answer[2 + 2 * 4 + 1], 7);   // ACK_SEQ
  EXPECT_EQ(answer[2 + 2 * 21 + 1], 7);  // RES_CMD_SEQ
  EXPECT_EQ(server.device.commands.size(), 1u);
}

TEST_F(Handshake, AnAcceptedCommandVoidsTheOldPoseAtOnce) {
  server.write(plc, 0, {1, 20});
  EXPECT_EQ(server.read(plc, 138, 2), (std::vector<std::uint16_t>{0x0001, 0xe240}));
  server.device.finish_at_once = false;
  server.write(plc, 0, {2, 20});
  EXPECT_EQ(server.read(plc, 138, 2), (std::vector<std::uint16_t>{0x8000, 0}));
  EXPECT_EQ(reg(plc, 120), 0);
  EXPECT_EQ(reg(plc, kFlags) & (kFlagDone | kFlagResultValid), 0);
  server.device.finish(2, 0);
  EXPECT_EQ(server.read(plc, 138, 2), (std::vector<std::uint16_t>{0x0001, 0xe240}));
  EXPECT_EQ(reg(plc, 120), 2);
}

TEST_F(Handshake, ResultValidFallsWhenTheFirstObjectIsNotAccepted) {
  server.device.result.objects[0].accepted = false;
  server.write(plc, 0, {1, 20});
  server.device.status.flags |= kFlagResultValid;  // a device that is wrong about it
  EXPECT_EQ(reg(plc, kFlags) & kFlagResultValid, 0);
  EXPECT_EQ(server.read(plc, 138, 2), (std::vector<std::uint16_t>{0x8000, 0}));
}

TEST_F(Handshake, AResultIsCopiedOnceAndStatusEveryTime) {
  server.write(plc, 0, {1, 20});
  for (int i = 0; i < 10; ++i) static_cast<void>(reg(plc, 120));
  EXPECT_EQ(server.device.result_reads, 1);
  server.device.status.heartbeat = 7;
  EXPECT_EQ(reg(plc, 103), 7);
  EXPECT_NE(reg(plc, kFlags) & kFlagHeartbeat, 0);
  server.device.status.heartbeat = 8;
  EXPECT_EQ(reg(plc, kFlags) & kFlagHeartbeat, 0);
}

TEST_F(Handshake, WordOrderCdabGoesBothWays) {
  ModbusConfig config = test_config();
  config.word_order = WordOrder::Cdab;
  HandDrivenServer swapped(config);
  swapped.device.result.objects.push_back(accepted_object());
  RawClient client = swapped.connect();
  swapped.write(client, 0, {1, 20, 0, 0, 0, 0, 0, 0, 0x0002, 0x0001, 0x1111, 0x2222});
  EXPECT_EQ(swapped.device.commands[0].enc_trigger, 0x00010002u);
  EXPECT_EQ(swapped.read(client, 132, 2), (std::vector<std::uint16_t>{0x1111, 0x2222}));
  EXPECT_EQ(swapped.read(client, 138, 2), (std::vector<std::uint16_t>{0xe240, 0x0001}));
  EXPECT_EQ(swapped.read(client, 900, 6),
            (std::vector<std::uint16_t>{0x5678, 0x1234, 0x1dc0, 0xfffe, 0x2000, 0x47f1}));
}

TEST_F(Handshake, TheProbeCountsTenthsOfASecond) {
  const auto before = server.read(plc, 907, 2);
  server.clock.advance_us(1'234'567);
  const auto after = server.read(plc, 907, 2);
  EXPECT_EQ(before, (std::vector<std::uint16_t>{0, 0}));
  EXPECT_EQ(after, (std::vector<std::uint16_t>{0, 12}));
}

TEST_F(Handshake, ClearCountersClearsTheFieldBussOwn) {
  EXPECT_EQ(server.ask_pdu(plc, {0x63}), (Bytes{0xe3, 1}));
  EXPECT_EQ(reg(plc, 629), 1);
  server.write(plc, 0, {1, 82});
  EXPECT_EQ(reg(plc, 629), 0);
  EXPECT_EQ(reg(plc, 623), 1) << "connections now are no counter";
}

TEST_F(Handshake, TheFirstWriterOwnsTheBlockAndOthersGetException1) {
  RawClient second = server.connect();
  server.write(plc, 0, {1, 20});
  EXPECT_EQ(server.write(second, 0, {2, 20}), (Bytes{0x90, 1}));
  EXPECT_EQ(server.write_one(second, 0, 3), (Bytes{0x86, 1}));
  EXPECT_EQ(server.ask_pdu(second, {23, 0, 100, 0, 1, 0, 0, 0, 1, 2, 0, 9}), (Bytes{0x97, 1}));
  EXPECT_EQ(server.device.commands.size(), 1u);
  EXPECT_EQ(reg(second, kAckSeq), 1) << "reading stays free";
  EXPECT_EQ(reg(second, 627), 3);
}

TEST_F(Handshake, AReadPeerNeverWrites) {
  RawClient reader = server.connect("127.0.0.2");
  EXPECT_EQ(server.write(reader, 0, {1, 20}), (Bytes{0x90, 1}));
  EXPECT_EQ(reg(reader, 906), 0x4142);
  EXPECT_TRUE(server.device.commands.empty());
  EXPECT_EQ(server.write(plc, 0, {1, 20}), (Bytes{16, 0, 0, 0, 2})) << "nobody had taken it";
}

TEST_F(Handshake, AWriteThatFailsTakesNothing) {
  RawClient second = server.connect();
  EXPECT_EQ(server.write(plc, 500, {1}), (Bytes{0x90, 2}));
  EXPECT_EQ(server.write(second, 0, {1, 20}), (Bytes{16, 0, 0, 0, 2}));
}

TEST_F(Handshake, OwnershipPassesWhenTheConnectionDies) {
  RawClient second = server.connect();
  server.write(plc, 0, {1, 20});
  plc.close();
  server.turn();
  EXPECT_EQ(server.device.control_losses, 1);
  EXPECT_EQ(server.write(second, 0, {2, 20}), (Bytes{16, 0, 0, 0, 2}));
  EXPECT_EQ(server.device.commands.size(), 2u);
}

TEST_F(Handshake, AnObserverThatLeavesIsNoLossOfControl) {
  RawClient second = server.connect();
  server.write(plc, 0, {1, 20});
  second.close();
  server.turn();
  EXPECT_EQ(server.device.control_losses, 0);
}

TEST_F(Handshake, ALostHeartbeatVoidsTheResultAndFreesTheBlock) {
  server.write(plc, 0, {1, 20});
  server.write(plc, 26, {1, 1000});
  server.clock.advance_us(999'000);
  server.turn();
  EXPECT_FALSE(server.device.heartbeat_lost);
  server.clock.advance_us(2'000);
  server.turn();
  EXPECT_TRUE(server.device.heartbeat_lost);
  EXPECT_EQ(server.device.control_losses, 1);
  const std::uint16_t flags = reg(plc, kFlags);
  EXPECT_EQ(flags & kFlagHeartbeatLost, kFlagHeartbeatLost);
  EXPECT_EQ(flags & (kFlagResultValid | kFlagReady), 0);
  EXPECT_EQ(server.read(plc, 138, 2), (std::vector<std::uint16_t>{0x8000, 0}));
  RawClient second = server.connect();
  EXPECT_EQ(server.write(second, 0, {2, 10}), (Bytes{16, 0, 0, 0, 2}));
}

TEST_F(Handshake, AHeartbeatThatBeatsKeepsTheDeviceReady) {
  server.write(plc, 26, {1, 500});
  for (std::uint16_t beat = 2; beat < 12; ++beat) {
    server.clock.advance_us(400'000);
    server.write_one(plc, 26, beat);
  }
  EXPECT_EQ(server.device.heartbeat_changes, 0);
}

TEST_F(Handshake, WritingTheSameBeatAgainIsNoHeartbeat) {
  server.write(plc, 26, {1, 500});
  for (int i = 0; i < 3; ++i) {
    server.clock.advance_us(200'000);
    server.write_one(plc, 26, 1);
  }
  EXPECT_TRUE(server.device.heartbeat_lost);
}

TEST_F(Handshake, AHeartbeatThatComesBackIsTold) {
  server.write(plc, 26, {1, 500});
  server.clock.advance_us(600'000);
  server.turn();
  ASSERT_TRUE(server.device.heartbeat_lost);
  server.write_one(plc, 26, 2);
  EXPECT_FALSE(server.device.heartbeat_lost);
  EXPECT_EQ(reg(plc, kFlags) & kFlagHeartbeatLost, 0);
  server.clock.advance_us(600'000);
  server.turn();
  EXPECT_TRUE(server.device.heartbeat_lost) << "supervised again";
}

TEST_F(Handshake, HeartbeatLimitsOutsideTheRangeCountAsItsNearerEnd) {
  server.write(plc, 26, {1, 1});
  server.clock.advance_us(499'000);
  server.turn();
  EXPECT_FALSE(server.device.heartbeat_lost);
  server.clock.advance_us(2'000);
  server.turn();
  EXPECT_TRUE(server.device.heartbeat_lost);
  server.write(plc, 26, {2, 0});
  EXPECT_FALSE(server.device.heartbeat_lost) << "0 ends the supervision";
  server.clock.advance_us(3'600'000'000);
  server.turn();
  EXPECT_FALSE(server.device.heartbeat_lost);
}

}  // namespace
}  // namespace grapnel::test
