// A reader against a writer that publishes as fast as it can: no read is ever torn.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "base/mailbox.h"
#include "drivers/modbus/register_image.h"
#include "tests/drivers/modbus/support/hand_driven_server.h"
#include "tests/drivers/modbus/support/server_thread.h"

namespace grapnel::test {
namespace {

struct Publication {
  PlcStatus status;
  PlcResult result;
};

/// Takes over what another thread publishes; everything in a publication carries its number.
class StressedDevice final : public PlcCommandSink {
 public:
  Code on_command(const PlcCommand&) noexcept override { return Code::Accepted; }
  void on_heartbeat_lost(bool) noexcept override {}
  void on_control_lost() noexcept override {}
  void read_status(PlcStatus& status) noexcept override {
    latest.update();
    status = latest.get().status;
  }
  void read_result(PlcResult& result) noexcept override { result = latest.get().result; }

  void publish(std::uint32_t number) noexcept {
    Publication& slot = latest.writable();
    slot.status.result_no = number;
    slot.status.flags = kFlagDone | kFlagResultValid;
    slot.status.frame_count = number;
    slot.result.frame_id = number;
    slot.result.part_tag = number;
    slot.result.seed = number;
    slot.result.objects.resize(kMaxObjects);
    for (std::size_t i = 0; i < kMaxObjects; ++i) {
      PlcObject& object = slot.result.objects[i];
      object.accepted = true;
      object.reasons = number;
      object.frame_from_grasp.translation() = Vec3d::Constant(number * 1e-6);
    }
    latest.publish();
  }

  Latest<Publication> latest;
};

// Whether registers 100…179, as one read brought them, belong to one publication.
bool whole(const Bytes& answer) {
  RegisterImage image;
  for (std::size_t i = 0; i < 80; ++i) {
    image.set_u16(100 + i, static_cast<std::uint16_t>(answer[9 + 2 * i] << 8 | answer[10 + 2 * i]));
  }
  const std::uint32_t number = image.u32(124);
  const std::uint16_t shown =
      number == 0 ? std::uint16_t{0} : static_cast<std::uint16_t>((number - 1) % 65535 + 1);
  const bool brackets = image.u16(120) == shown && image.u16(179) == shown;
  const bool heads =
      image.u32(112) == number && image.u32(132) == number && image.u32(172) == number;
  const bool object = number == 0 || (image.u32(138) == number && image.u32(140) == number &&
                                      image.u32(142) == number && image.u32(163) == number);
  return brackets && heads && object;
}

TEST(ModbusTornReads, NoneInAHundredThousandUnderAWriter) {
  constexpr int kReads = 100'000;
  constexpr int kPipelined = 10;
  StressedDevice device;
  ServerThread thread(test_config(), device);
  std::atomic<bool> stop{false};
  std::thread writer([&] {
    for (std::uint32_t number = 1; !stop; ++number) {
      device.publish(number % 2'000'000'000);
      if (number % 8 == 0) std::this_thread::yield();  // both cores may be busy
    }
  });
  RawClient client(thread.port());
  const Bytes request = make_adu(1, 1, {4, 0, 100, 0, 80});
  Bytes requests;
  for (int i = 0; i < kPipelined; ++i) requests = requests + request;
  int torn = 0;
  int answered = 0;
  std::uint32_t distinct = 0;
  std::uint32_t last = 0;
  while (answered < kReads) {
    ASSERT_EQ(client.send(requests), requests.size());
    for (int i = 0; i < kPipelined; ++i) {
      const Bytes answer = client.wait_answer(10'000);
      ASSERT_EQ(answer.size(), 9u + 160u);
      torn += whole(answer) ? 0 : 1;
      const std::uint32_t number = static_cast<std::uint32_t>(
          answer[9 + 48] << 24 | answer[10 + 48] << 16 | answer[11 + 48] << 8 | answer[12 + 48]);
      distinct += number != last ? 1 : 0;
      last = number;
      ++answered;
    }
  }
  stop = true;
  writer.join();
  EXPECT_EQ(torn, 0);
  EXPECT_GT(distinct, 100u) << "the writer did not get in between the reads";
}

}  // namespace
}  // namespace grapnel::test
