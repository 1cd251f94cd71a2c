// The serial line, over a pseudo terminal.
#include <gtest/gtest.h>

#include <fcntl.h>
#include <pty.h>
#include <unistd.h>

#include <array>

#include "drivers/modbus/rtu_framing.h"
#include "tests/drivers/modbus/support/hand_driven_server.h"

namespace grapnel::test {
namespace {

constexpr std::int64_t kSilenceUs = 2'100;  // beyond 3.5 characters at 19200 baud

TEST(RtuFraming, CrcAgreesWithPublishedValues) {
  const Bytes check = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  EXPECT_EQ(crc16_modbus(check), 0x4b37);  // catalogue of CRC algorithms, CRC-16/MODBUS
  // Read of ten registers from slave 1: 01 03 00 00 00 0A C5 CD on the line.
  EXPECT_EQ(crc16_modbus(Bytes{1, 3, 0, 0, 0, 10}), 0xcdc5);
}

TEST(RtuFraming, SilenceIsThreeAndAHalfCharactersAndFixedOnFastLines) {
  EXPECT_EQ(rtu_silence_us(9600), 4010);
  EXPECT_EQ(rtu_silence_us(19200), 2005);
  EXPECT_EQ(rtu_silence_us(115200), 1750);
}

Bytes sealed(Bytes frame) {
  const std::uint16_t crc = crc16_modbus(frame);
  return frame + Bytes{static_cast<std::uint8_t>(crc & 0xff), static_cast<std::uint8_t>(crc >> 8)};
}

class RtuLine : public testing::Test {
 protected:
  static ModbusConfig config_on(const char* device) {
    ModbusConfig config = test_config();
    config.rtu_device = device;
    config.rtu_slave_id = 7;
    config.strict_unit_id = true;  // means nothing on a serial line
    return config;
  }

  RtuLine() {
    std::array<char, 128> name{};
    if (openpty(&master_, &slave_, name.data(), nullptr, nullptr) != 0) return;
    fcntl(master_, F_SETFL, O_NONBLOCK);
    server_ = std::make_unique<HandDrivenServer>(config_on(name.data()));
  }
  ~RtuLine() override {
    if (master_ >= 0) close(master_);
    if (slave_ >= 0) close(slave_);
  }

  void send(const Bytes& bytes) {
    ASSERT_EQ(write(master_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
    server_->turn();
  }
  /// Sends a frame, lets the line fall silent, and takes what comes back.
  Bytes ask(const Bytes& frame) {
    send(frame);
    return silence();
  }
  Bytes silence() {
    server_->clock.advance_us(kSilenceUs);
    server_->turn();
    Bytes answer(512);
    const ssize_t count = read(master_, answer.data(), answer.size());
    answer.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
    return answer;
  }

  const Bytes kAsk = sealed({7, 4, 0x03, 0x84, 0, 2});
  const Bytes kAnswer = sealed({7, 4, 4, 0x12, 0x34, 0x56, 0x78});

  int master_ = -1;
  int slave_ = -1;
  std::unique_ptr<HandDrivenServer> server_;
};

TEST_F(RtuLine, AnswersAfterSilenceAndNotBefore) {
  send(kAsk);
  std::uint8_t byte = 0;
  EXPECT_LT(read(master_, &byte, 1), 0);
  EXPECT_EQ(silence(), kAnswer);
}

TEST_F(RtuLine, AWrongCrcIsNoRequest) {
  Bytes bad = kAsk;
  bad.back() ^= 1;
  EXPECT_TRUE(ask(bad).empty());
  EXPECT_EQ(server_->server.counters().bytes_discarded, 8u);
  EXPECT_EQ(ask(kAsk), kAnswer);
}

TEST_F(RtuLine, ARequestForAnotherSlaveDoesNotCostTheNext) {
  EXPECT_TRUE(ask(sealed({8, 4, 0x03, 0x84, 0, 2})).empty());
  EXPECT_EQ(ask(kAsk), kAnswer);
  // The other slave's answer on a shared line.
  EXPECT_TRUE(ask(sealed({8, 4, 4, 0, 0, 0, 0})).empty());
  EXPECT_EQ(ask(kAsk), kAnswer);
}

TEST_F(RtuLine, ATornFrameIsDroppedAtTheSilence) {
  EXPECT_TRUE(ask({7, 4, 0x03}).empty());
  EXPECT_EQ(ask(kAsk), kAnswer);
}

TEST_F(RtuLine, BytesWithoutSilenceBetweenAreOneFrame) {
  send(Bytes(kAsk.begin(), kAsk.begin() + 4));
  server_->clock.advance_us(1'000);
  send(Bytes(kAsk.begin() + 4, kAsk.end()));
  EXPECT_EQ(silence(), kAnswer);
}

TEST_F(RtuLine, NoiseLongerThanAFrameIsDropped) {
  EXPECT_TRUE(ask(Bytes(300, 0x55)).empty());
  EXPECT_EQ(server_->server.counters().bytes_discarded, 300u);
  EXPECT_EQ(ask(kAsk), kAnswer);
}

TEST_F(RtuLine, ExceptionsTravelToo) {
  EXPECT_EQ(ask(sealed({7, 0x11})), sealed({7, 0x91, 1}));
  EXPECT_EQ(ask(sealed({7, 4, 0, 0, 0, 1})), sealed({7, 0x84, 2}));
  EXPECT_EQ(ask(sealed({7, 3, 0, 100, 0, 0})), sealed({7, 0x83, 3}));
  EXPECT_EQ(ask(sealed({7, 3, 0, 100, 0, 1, 9})), sealed({7, 0x83, 3}));
}

TEST_F(RtuLine, WritesRunCommands) {
  EXPECT_EQ(ask(sealed({7, 16, 0, 0, 0, 2, 4, 0, 1, 0, 20})), sealed({7, 16, 0, 0, 0, 2}));
  ASSERT_EQ(server_->device.commands.size(), 1u);
  EXPECT_EQ(server_->device.commands[0].code, 20);
}

TEST_F(RtuLine, ABroadcastWriteRunsWithoutAnAnswer) {
  EXPECT_TRUE(ask(sealed({0, 16, 0, 0, 0, 2, 4, 0, 1, 0, 20})).empty());
  EXPECT_EQ(server_->device.commands.size(), 1u);
}

TEST_F(RtuLine, OwnsTheBlockUntilItHasBeenSilentForTenSeconds) {
  RawClient tcp = server_->connect();
  ASSERT_FALSE(ask(sealed({7, 6, 0, 1, 0, 20})).empty());
  EXPECT_EQ(server_->write(tcp, 0, {1, 20}), (Bytes{0x90, 1}));
  server_->clock.advance_us(9'000'000);
  EXPECT_EQ(ask(kAsk), kAnswer);
  server_->clock.advance_us(9'900'000);
  server_->turn();
  EXPECT_EQ(server_->device.control_losses, 0);
  server_->clock.advance_us(200'000);
  server_->turn();
  EXPECT_EQ(server_->device.control_losses, 1);
  EXPECT_EQ(server_->write(tcp, 0, {1, 20}), (Bytes{16, 0, 0, 0, 2}));
}

TEST_F(RtuLine, ALineThatGoesAwayFreesTheBlockAndHarmsNobody) {
  RawClient tcp = server_->connect();
  ASSERT_FALSE(ask(sealed({7, 6, 0, 1, 0, 20})).empty());
  close(slave_);
  close(master_);
  slave_ = master_ = -1;
  server_->turn();
  EXPECT_EQ(server_->device.control_losses, 1);
  for (int i = 0; i < 5; ++i) {
    server_->clock.advance_us(1'100'000);
    server_->turn();
  }
  EXPECT_EQ(server_->write(tcp, 0, {1, 20}), (Bytes{16, 0, 0, 0, 2}));
}

TEST(RtuLink, ADeviceThatIsMissingOrARateThatIsNoneIsAProblemInOneLine) {
  ModbusConfig config = test_config();
  config.rtu_device = "/dev/no-such-line";
  ScriptedDevice device;
  const MonotonicClock clock;
  ModbusServer missing(config, device, clock);
  EXPECT_FALSE(missing.open().ok());
  EXPECT_NE(missing.problem().find("/dev/no-such-line"), std::string::npos);
  config.rtu_baud = 12345;
  ModbusServer odd(config, device, clock);
  EXPECT_FALSE(odd.open().ok());
  EXPECT_NE(odd.problem().find("12345"), std::string::npos);
}

}  // namespace
}  // namespace grapnel::test
