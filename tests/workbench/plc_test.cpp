#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/drivers/modbus/support/hand_driven_server.h"
#include "tests/drivers/modbus/support/server_thread.h"
#include "workbench/commands.h"

namespace grapnel {
namespace {

using nlohmann::json;
using test::ScriptedDevice;
using test::ServerThread;

struct Output {
  int exit_code = -1;
  std::string text;
};

Output run(std::vector<std::string> args) {
  args.insert(args.begin(), "plc");
  Output result;
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  result.exit_code = run_grapnel(args);
  result.text = testing::internal::GetCapturedStdout();
  result.text += testing::internal::GetCapturedStderr();
  return result;
}

std::string address(const ServerThread& server) {
  return "127.0.0.1:" + std::to_string(server.port());
}

ScriptedDevice device_with_part() {
  ScriptedDevice device;
  device.status.flags = kFlagReady;
  device.result.code = Code::ObjectFound;
  device.result.pose_format = 1;
  device.result.objects.push_back(test::accepted_object());
  return device;
}

TEST(PlcCommandLine, PrintsOneJsonObjectWithEveryResult) {
  ScriptedDevice device = device_with_part();
  ServerThread server(test::test_config(), device);
  const Output result = run({address(server), "--count", "3", "--interval-ms", "1", "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.text;
  const json answer = json::parse(result.text);
  ASSERT_EQ(answer["results"].size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const json& one = answer["results"][i];
    EXPECT_EQ(one["part_tag"], i + 1);
    EXPECT_EQ(one["ack_code"], 3100);
    EXPECT_EQ(one["result"]["code"], 1100);
    EXPECT_EQ(one["result"]["part_tag"], i + 1);
    const json& object = one["result"]["objects"][0];
    EXPECT_EQ(object["decision"], "accept");
    EXPECT_NEAR(object["pose"][0].get<double>(), 123.456, 1e-9);
    EXPECT_NEAR(object["transform"][3].get<double>(), 0.123456, 1e-9);
  }
}

TEST(PlcCommandLine, SaysInWordsWhatCame) {
  ScriptedDevice device = device_with_part();
  ServerThread server(test::test_config(), device);
  const Output result = run({address(server), "--tag", "5"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_NE(result.text.find("part 5: 1100 object found"), std::string::npos) << result.text;
  EXPECT_NE(result.text.find("X 123.456 Y -200.000 Z 1500.000 mm"), std::string::npos);
}

TEST(PlcCommandLine, ARejectedObjectHasNoPose) {
  ScriptedDevice device = device_with_part();
  device.result.code = Code::NoObjectAccepted;
  device.result.objects[0].accepted = false;
  device.result.objects[0].code = Code::Ambiguous;
  device.result.objects[0].reasons = 1u << 10;
  ServerThread server(test::test_config(), device);
  const Output result = run({address(server), "--json"});
  EXPECT_EQ(result.exit_code, 0) << "the trigger was answered";
  const json object = json::parse(result.text)["results"][0]["result"]["objects"][0];
  EXPECT_EQ(object["decision"], "reject");
  EXPECT_EQ(object["code"], 1010);
  EXPECT_EQ(object["reasons"], json::array({1010}));
  EXPECT_TRUE(object["pose"].is_null());
  EXPECT_TRUE(object["transform"].is_null());
}

TEST(PlcCommandLine, ARefusedTriggerEndsWith1) {
  ScriptedDevice device = device_with_part();
  device.answer = Code::NotArmed;
  ServerThread server(test::test_config(), device);
  const Output result = run({address(server), "--no-arm"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.text.find("refused: 3003 not armed"), std::string::npos) << result.text;
}

TEST(PlcCommandLine, ArmsADeviceThatIsNotReady) {
  ScriptedDevice device = device_with_part();
  device.status.flags = 0;
  {
    ServerThread server(test::test_config(), device);
    EXPECT_EQ(run({address(server)}).exit_code, 0);
  }
  ASSERT_EQ(device.commands.size(), 2u);
  EXPECT_EQ(device.commands[0].code, 10);
  EXPECT_EQ(device.commands[1].code, 20);
}

TEST(PlcCommandLine, SendsParametersAndHeartbeat) {
  ScriptedDevice device = device_with_part();
  {
    ServerThread server(test::test_config(), device);
    EXPECT_EQ(run({address(server), "--preset", "3", "--model", "4", "--format", "6",
                   "--timeout-ms", "250", "--code", "24", "--heartbeat-ms", "500"})
                  .exit_code,
              0);
  }
  ASSERT_EQ(device.commands.size(), 1u);
  EXPECT_EQ(device.commands[0].preset_id, 3);
  EXPECT_EQ(device.commands[0].model_id, 4);
  EXPECT_EQ(device.commands[0].pose_format, 6);
  EXPECT_EQ(device.commands[0].timeout_ms, 250);
  EXPECT_EQ(device.commands[0].code, 24);
}

TEST(PlcCommandLine, AStrictCycleCountsWhatCameOfEachTrigger) {
  ScriptedDevice device = device_with_part();
  ServerThread server(test::test_config(), device);
  const Output result =
      run({address(server), "--strict", "--count", "5", "--interval-ms", "20", "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.text;
  const json tally = json::parse(result.text);
  EXPECT_EQ(tally["triggers"], 5);
  EXPECT_EQ(tally["answered"], 5);
  EXPECT_EQ(tally["accepted"], 5);
  EXPECT_EQ(tally["codes"], (json{{"1100", 5}}));
  for (const char* none : {"refused_busy", "refused_other", "late", "lost"}) {
    EXPECT_EQ(tally[none], 0) << none;
  }
}

TEST(PlcCommandLine, AStrictCycleGoesOnOverBusyLateAndMissingAnswers) {
  struct Case {
    Code answer;
    Code outcome;
    bool finish;
    const char* counted;
  };
  for (const Case& one : {Case{Code::Busy, Code::ObjectFound, true, "refused_busy"},
                          Case{Code::NotArmed, Code::ObjectFound, true, "refused_other"},
                          Case{Code::Accepted, Code::JobDeadline, true, "late"},
                          Case{Code::Accepted, Code::ObjectFound, false, "lost"}}) {
    ScriptedDevice device = device_with_part();
    device.answer = one.answer;
    device.result.code = one.outcome;
    device.finish_at_once = one.finish;
    ServerThread server(test::test_config(), device);
    const Output result = run({address(server), "--strict", "--no-arm", "--count", "3",
                               "--interval-ms", "5", "--answer-timeout-ms", "20", "--json"});
    EXPECT_EQ(result.exit_code, 1) << result.text;
    EXPECT_EQ(json::parse(result.text)[one.counted], 3) << result.text;
  }
}

TEST(PlcCommandLine, WrongAddressesAreWrongUsage) {
  for (const char* wrong : {"127.0.0.1:x", "127.0.0.1:0", ":502", "127.0.0.1:1"}) {
    EXPECT_EQ(run({wrong}).exit_code, 2) << wrong;
  }
}

}  // namespace
}  // namespace grapnel
