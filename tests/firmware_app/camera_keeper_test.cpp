#include "firmware_app/camera_keeper.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include "base/clock.h"

namespace grapnel {
namespace {

constexpr std::int64_t kPatienceUs = 10'000'000;

struct Plug {
  std::atomic<bool> slow{true};
  std::atomic<bool> foreign{false};
  std::atomic<int> openings{0};
};

/// Opening takes until the test lets it.
class SlowCamera final : public Camera {
 public:
  explicit SlowCamera(Plug& plug) : plug_(plug) {}
  Result<CameraInfo> open() override {
    ++plug_.openings;
    while (plug_.slow.load()) clock_.sleep_until_us(clock_.now_us() + 1000);
    if (plug_.foreign.load()) return Error{Code::WrongSerial, Stage::Capture, 0};
    CameraInfo info;
    info.serial = "UNIT7";
    info.intrinsics = {32, 24, 30.0, 30.0, 15.5, 11.5};
    return info;
  }
  Status start(FramePool&, const CaptureHooks&) override {
    streaming_.store(true);
    return {};
  }
  void stop() noexcept override { streaming_.store(false); }
  void close() noexcept override { stop(); }
  [[nodiscard]] CameraStatus status() const noexcept override {
    CameraStatus status;
    status.state = streaming_.load() ? CameraState::Streaming : CameraState::Closed;
    status.code = streaming_.load() ? Code::SensorHealthy : Code::SensorNotConnected;
    return status;
  }
  [[nodiscard]] std::string problem() const override { return "none"; }

 private:
  Plug& plug_;
  MonotonicClock clock_;
  std::atomic<bool> streaming_{false};
};

TEST(CameraKeeper, SaysThatItOpensUntilTheFirstOpeningHasEndedAndWhoseCameraItIs) {
  Plug plug;
  FramePool pool(2, 32, 24, false);
  Supervisor supervisor;
  ThreadAccount account;
  std::FILE* const nowhere = std::fopen("/dev/null", "w");
  Journal journal(false, nowhere);
  std::atomic<bool> foreign{false};
  MonotonicClock clock;
  const auto eventually = [&](const auto& happened) {
    const std::int64_t until_us = clock.now_us() + kPatienceUs;
    while (!happened() && clock.now_us() < until_us) clock.sleep_until_us(clock.now_us() + 1000);
    return happened();
  };
  {
    CameraKeeper keeper(std::make_unique<SlowCamera>(plug),
                        {&pool, &supervisor, &account, &journal, &foreign}, {}, "UNIT8");
    ASSERT_TRUE(keeper.start());
    ASSERT_TRUE(eventually([&] { return plug.openings.load() == 1; }));
    EXPECT_EQ(keeper.code(), Code::SensorOpening);
    plug.foreign = true;
    plug.slow = false;
    EXPECT_TRUE(eventually([&] { return keeper.code() == Code::WrongSerial; }))
        << "why it does not open, though it is only closed";
    plug.foreign = false;
    EXPECT_TRUE(eventually([&] { return keeper.code() == Code::SensorHealthy; }));
    EXPECT_EQ(keeper.serial(), "UNIT7");
    EXPECT_TRUE(foreign.load()) << "the calibration is of UNIT8";
  }
  std::fclose(nowhere);
}

}  // namespace
}  // namespace grapnel
