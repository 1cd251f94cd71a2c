// Foreign clients against the server: mbpoll (C, libmodbus) on TCP and RTU, and our Python client.
#include <gtest/gtest.h>

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>

#include "tests/drivers/modbus/support/hand_driven_server.h"
#include "tests/drivers/modbus/support/server_thread.h"

namespace grapnel::test {
namespace {

struct Output {
  int exit_code = -1;
  std::string text;
};

Output run(const std::string& command) {
  Output output;
  FILE* pipe = popen(("exec 2>&1\n" + command).c_str(), "r");
  if (pipe == nullptr) return output;
  std::array<char, 512> part;
  while (std::fgets(part.data(), part.size(), pipe) != nullptr) output.text += part.data();
  output.exit_code = pclose(pipe);
  return output;
}

bool present(const char* program) {
  return run(std::string("command -v ") + program).exit_code == 0;
}

// "[900]: \t305419896" → the value behind an address in mbpoll's output.
std::string value_at(const std::string& text, int address) {
  const std::string mark = "[" + std::to_string(address) + "]:";
  const std::size_t at = text.find(mark);
  if (at == std::string::npos) return "missing in: " + text;
  const std::size_t begin = text.find_first_not_of(" \t", at + mark.size());
  return text.substr(begin, text.find_first_of("\n (", begin) - begin);
}

class Mbpoll : public testing::TestWithParam<WordOrder> {
 protected:
  void SetUp() override {
    if (!present("mbpoll")) GTEST_SKIP() << "mbpoll is not installed";
  }
  // mbpoll reads ABCD with -B and CDAB without.
  std::string poll(std::uint16_t port, const std::string& options) const {
    const std::string order = GetParam() == WordOrder::Abcd ? " -B " : " ";
    return run("mbpoll -m tcp -0 -1 -a 1 -p " + std::to_string(port) + order + options).text;
  }
  ModbusConfig config() const {
    ModbusConfig config = test_config();
    config.word_order = GetParam();
    return config;
  }
};

TEST_P(Mbpoll, ReadsTheProbe) {
  ScriptedDevice device;
  ServerThread thread(config(), device);
  const std::string integers = poll(thread.port(), "-t 3:int -r 900 -c 2 127.0.0.1");
  EXPECT_EQ(value_at(integers, 900), "305419896");
  EXPECT_EQ(value_at(integers, 902), "-123456");
  EXPECT_EQ(value_at(poll(thread.port(), "-t 3:float -r 904 -c 1 127.0.0.1"), 904), "123456");
  EXPECT_EQ(value_at(poll(thread.port(), "-t 4:hex -r 906 -c 1 127.0.0.1"), 906), "0x4142");
}

TEST_P(Mbpoll, TriggersAndReadsAPose) {
  ScriptedDevice device;
  device.result.objects.push_back(accepted_object());
  ServerThread thread(config(), device);
  const std::string written = poll(thread.port(), "-t 4 -r 0 127.0.0.1 1 20");
  EXPECT_NE(written.find("Written 2 references"), std::string::npos) << written;
  EXPECT_EQ(value_at(poll(thread.port(), "-t 3 -r 104 -c 1 127.0.0.1"), 104), "1");
  const std::string pose = poll(thread.port(), "-t 3:int -r 138 -c 3 127.0.0.1");
  EXPECT_EQ(value_at(pose, 138), "123456");
  EXPECT_EQ(value_at(pose, 140), "-200000");
  EXPECT_EQ(value_at(pose, 142), "1500000");
  EXPECT_EQ(value_at(poll(thread.port(), "-t 3:float -r 701 -c 1 127.0.0.1"), 701), "123.456");
}

TEST_P(Mbpoll, SeesTheSentinelWithoutAResult) {
  ScriptedDevice device;
  ServerThread thread(config(), device);
  EXPECT_EQ(value_at(poll(thread.port(), "-t 3:int -r 138 -c 1 127.0.0.1"), 138), "-2147483648");
  EXPECT_EQ(value_at(poll(thread.port(), "-t 3:float -r 701 -c 1 127.0.0.1"), 701), "nan");
}

TEST_P(Mbpoll, ReadsTheProbeOverASerialLine) {
  if (!present("socat")) GTEST_SKIP() << "socat is not installed";
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("grapnel-rtu-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  const std::string ours = folder / "a";
  const std::string theirs = folder / "b";
  FILE* pair = popen(("exec socat pty,raw,echo=0,link=" + ours + " pty,raw,echo=0,link=" + theirs +
                      " 2>&1 & echo $!")
                         .c_str(),
                     "r");
  ASSERT_NE(pair, nullptr);
  long socat = 0;
  ASSERT_EQ(std::fscanf(pair, "%ld", &socat), 1);
  for (int i = 0; i < 500 && !(std::filesystem::exists(ours) && std::filesystem::exists(theirs));
       ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  {
    ModbusConfig serial = config();
    serial.listen_address = "";
    serial.rtu_device = ours;
    serial.rtu_baud = 115200;
    serial.rtu_parity = SerialParity::None;
    serial.rtu_slave_id = 7;
    ScriptedDevice device;
    ServerThread thread(serial, device);
    const std::string order = GetParam() == WordOrder::Abcd ? " -B" : "";
    const std::string base = "mbpoll -m rtu -b 115200 -P none -0 -1 -o 3" + order;
    // Another slave first: its time-out must not cost our next answer.
    static_cast<void>(run(base + " -o 0.2 -a 8 -t 3:int -r 900 -c 2 " + theirs));
    const Output output = run(base + " -a 7 -t 3:int -r 900 -c 2 " + theirs);
    EXPECT_EQ(value_at(output.text, 900), "305419896");
    EXPECT_EQ(value_at(output.text, 902), "-123456");
  }
  static_cast<void>(run("kill " + std::to_string(socat)));
  pclose(pair);
  std::error_code gone;  // socat removes its links itself when it ends
  std::filesystem::remove_all(folder, gone);
}

INSTANTIATE_TEST_SUITE_P(WordOrders, Mbpoll, testing::Values(WordOrder::Abcd, WordOrder::Cdab));

class PythonClient : public testing::TestWithParam<WordOrder> {};

TEST_P(PythonClient, ReadsByNameTriggersAndDecodes) {
  if (!present("python3")) GTEST_SKIP() << "python3 is not installed";
  ModbusConfig config = test_config();
  config.word_order = GetParam();
  ScriptedDevice device;
  device.result.pose_format = 1;
  device.result.code = Code::ObjectFound;
  device.result.objects.push_back(accepted_object());
  device.result.objects.push_back(accepted_object());
  device.result.objects[1].accepted = false;
  ServerThread thread(config, device);
  const std::string order = GetParam() == WordOrder::Abcd ? "ABCD" : "CDAB";
  const std::string program =
      "import sys, math\n"
      "sys.dont_write_bytecode = True\n"
      "sys.path.insert(0, '" GRAPNEL_SOURCE_DIR
      "/docs/clients')\n"
      "from grapnel_client import Grapnel\n"
      "d = Grapnel('127.0.0.1', " +
      std::to_string(thread.port()) + ", word_order='" + order +
      "')\n"
      "p = d.read('probe')\n"
      "assert p['PROBE_U32'] == 0x12345678 and p['PROBE_I32'] == -123456, p\n"
      "assert p['PROBE_F32'] == 123456.0 and p['PROBE_AB'] == 0x4142, p\n"
      "assert math.isnan(d.read('float_mirror')['X_MM'])\n"
      "ack, status = d.command(20, PART_TAG=0x12345678)\n"
      "assert ack == 3100 and status['MAP_VERSION'] == 256, status\n"
      "r = d.result()\n"
      "assert r['PART_TAG'] == 0x12345678 and r['RES_CODE'] == 1100, r\n"
      "assert len(r['objects']) == 2, r\n"
      "o = r['objects'][0]\n"
      "assert abs(o['X'] - 123.456) < 1e-9 and o['DECISION'] == 1 and o['R1'] == 0, o\n"
      "assert math.isnan(r['objects'][1]['X']), r\n"
      "assert abs(d.read('float_mirror')['X_MM'] - 123.456) < 1e-4\n"
      "print('all right')\n";
  const Output output = run("python3 - <<'END'\n" + program + "END\n");
  EXPECT_NE(output.text.find("all right"), std::string::npos) << output.text;
}

INSTANTIATE_TEST_SUITE_P(WordOrders, PythonClient,
                         testing::Values(WordOrder::Abcd, WordOrder::Cdab));

}  // namespace
}  // namespace grapnel::test
