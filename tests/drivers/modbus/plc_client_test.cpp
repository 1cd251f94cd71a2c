#include "drivers/modbus/plc_client.h"

#include <gtest/gtest.h>

#include "tests/drivers/modbus/support/hand_driven_server.h"
#include "tests/drivers/modbus/support/server_thread.h"

namespace grapnel::test {
namespace {

// The device is touched by the server's thread alone while it runs.
class PlcClientTest : public testing::TestWithParam<WordOrder> {
 protected:
  PlcClientTest() {
    device.result.code = Code::ObjectFound;
    device.result.pose_format = 1;
    for (int i = 0; i < 3; ++i) {
      PlcObject object = accepted_object();
      object.model_id = static_cast<std::uint16_t>(i + 1);
      object.fitness = 0.9;
      device.result.objects.push_back(object);
    }
    device.result.objects[2].accepted = false;
    device.result.objects[2].code = Code::BelowFitness;
  }

  PlcClientOptions options(const ServerThread& thread) const {
    PlcClientOptions client;
    client.port = thread.port();
    client.word_order = GetParam();
    return client;
  }
  ModbusConfig config() const {
    ModbusConfig server = test_config();
    server.word_order = GetParam();
    return server;
  }

  ScriptedDevice device;
};

TEST_P(PlcClientTest, TriggersAndReadsEveryObject) {
  ServerThread thread(config(), device);
  PlcClient client(options(thread));
  ASSERT_TRUE(client.connect().ok()) << client.problem();
  PlcCommand command;
  command.code = 20;
  command.part_tag = 0x12345678;
  for (std::uint16_t cycle = 1; cycle <= 5; ++cycle) {
    const Result<PlcAnswer> answer = client.run(command, 5000, true);
    ASSERT_TRUE(answer.ok()) << client.problem();
    EXPECT_TRUE(answer.value().done);
    const PlcResult& result = answer.value().reading.result;
    EXPECT_EQ(answer.value().reading.result_no, cycle);
    EXPECT_EQ(result.cmd_seq, cycle);
    EXPECT_EQ(result.part_tag, 0x12345678u);
    ASSERT_EQ(result.objects.size(), 3u);
    EXPECT_EQ(result.objects[1].model_id, 2);
    EXPECT_TRUE(result.objects[1].accepted);
    EXPECT_NEAR(result.objects[1].frame_from_grasp.translation().x(), 0.123456, 1e-9);
    EXPECT_FALSE(result.objects[2].accepted);
    EXPECT_EQ(result.objects[2].code, Code::BelowFitness);
    EXPECT_EQ(answer.value().reading.poses[2][0], kNoPose);
  }
}

TEST_P(PlcClientTest, WritesOneByOneWhenAsked) {
  ServerThread thread(config(), device);
  PlcClientOptions single = options(thread);
  single.single_writes = true;
  PlcClient client(single);
  ASSERT_TRUE(client.connect().ok());
  PlcCommand command;
  command.code = 20;
  command.enc_trigger = 0xabcd1234;
  ASSERT_TRUE(client.run(command, 5000, true).ok()) << client.problem();
  thread.stop();
  ASSERT_EQ(device.commands.size(), 1u);
  EXPECT_EQ(device.commands[0].enc_trigger, 0xabcd1234u);
}

TEST_P(PlcClientTest, TellsARefusalFromAnAnswer) {
  device.answer = Code::UnknownCommand;
  ServerThread thread(config(), device);
  PlcClient client(options(thread));
  ASSERT_TRUE(client.connect().ok());
  PlcCommand command;
  command.code = 999;
  const Result<PlcAnswer> answer = client.run(command, 5000, true);
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(answer.value().ack_code, Code::UnknownCommand);
  EXPECT_FALSE(answer.value().done);
}

TEST_P(PlcClientTest, GivesUpOnAnAnswerThatDoesNotCome) {
  device.finish_at_once = false;
  ServerThread thread(config(), device);
  PlcClient client(options(thread));
  ASSERT_TRUE(client.connect().ok());
  PlcCommand command;
  command.code = 20;
  const Result<PlcAnswer> answer = client.run(command, 50, true);
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.error().code, Code::NoFrameInTime);
  EXPECT_NE(client.problem().find("no answer to command 20"), std::string::npos);
}

TEST_P(PlcClientTest, SaysWhyItCannotConnect) {
  PlcClientOptions nowhere;
  nowhere.port = 1;
  PlcClient client(nowhere);
  EXPECT_FALSE(client.connect().ok());
  EXPECT_NE(client.problem().find("127.0.0.1:1: can't connect"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(WordOrders, PlcClientTest,
                         testing::Values(WordOrder::Abcd, WordOrder::Cdab));

}  // namespace
}  // namespace grapnel::test
