#include "drivers/live/frame_timer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/rng.h"

namespace grapnel {
namespace {

constexpr std::int64_t kPeriod_us = 33'333;
constexpr std::int64_t kStart_us = 5'000'000;

SensorStamp stamp(std::int64_t device_us, std::int64_t arrival_us, std::uint64_t generation = 1) {
  SensorStamp made;
  made.device_us = device_us;
  made.arrival_us = arrival_us;
  made.generation = generation;
  return made;
}

TEST(TickUnwrapper, GoesOnOverTheEndOfThe32BitCounter) {
  // 60 MHz: 2^32 ticks are 71.58 s.
  TickUnwrapper unwrapper(60);
  std::uint64_t ticks = 0xffffffffULL - 5 * 2'000'000ULL;
  const std::int64_t first_us = unwrapper.time_us(static_cast<std::uint32_t>(ticks));
  for (int frame = 1; frame <= 10; ++frame) {
    ticks += 2'000'000;
    const std::int64_t time_us = unwrapper.time_us(static_cast<std::uint32_t>(ticks));
    // Ticks to microseconds rounds down: half a microsecond either way.
    EXPECT_NEAR(static_cast<double>(time_us - first_us), frame * 2'000'000.0 / 60.0, 1.0);
  }
}

TEST(FrameTimer, FollowsADriftingClockThroughLateArrivals) {
  // A device clock that is 100 ppm slow or fast, frames up to 8 ms late: the true host time of a
  // stamp is start + n periods. What is lost between two punctual frames is the drift: with every
  // third frame within 0.3 ms, a rise of 200 ppm over 10 periods is 0.07 ms.
  for (const double drift : {-100e-6, 0.0, 100e-6}) {
    FrameTimer timer(30.0, 0);
    Rng rng(7);
    double worst_us = 0.0;
    for (int n = 0; n < 5000; ++n) {
      const double true_us = kStart_us + n * 33'333.0;
      const double late_us = n % 3 == 0 ? 300.0 * rng.uniform() : 8'000.0 * rng.uniform();
      const auto device_us = static_cast<std::int64_t>(n * 33'333.0 * (1.0 + drift));
      const FrameTime time =
          timer.next(stamp(device_us, static_cast<std::int64_t>(true_us + late_us)));
      if (n > 100) {
        worst_us = std::max(worst_us, std::fabs(static_cast<double>(time.exposure_us) - true_us));
      }
    }
    EXPECT_LT(worst_us, 500.0) << drift;
  }
}

TEST(FrameTimer, CountsTheFramesThatNeverArrived) {
  FrameTimer timer(30.0, 0);
  (void)timer.next(stamp(0, kStart_us));
  FrameTime time = timer.next(stamp(kPeriod_us, kStart_us + kPeriod_us));
  EXPECT_EQ(time.sequence, 1u);
  EXPECT_EQ(time.missed, 0u);
  time = timer.next(stamp(4 * kPeriod_us, kStart_us + 4 * kPeriod_us));
  EXPECT_EQ(time.sequence, 4u);
  EXPECT_EQ(time.missed, 2u);
}

TEST(FrameTimer, BelievesTheDevicesOwnCounterBeforeItsClock) {
  FrameTimer timer(30.0, 0);
  SensorStamp first = stamp(0, kStart_us);
  first.index = 7;
  (void)timer.next(first);
  SensorStamp second = stamp(kPeriod_us, kStart_us + kPeriod_us);
  second.index = 10;
  EXPECT_EQ(timer.next(second).missed, 2u);
}

TEST(FrameTimer, TakesAPauseForNoLoss) {
  FrameTimer timer(30.0, 0);
  (void)timer.next(stamp(0, kStart_us));
  timer.pause();
  const FrameTime time = timer.next(stamp(90 * kPeriod_us, kStart_us + 90 * kPeriod_us));
  EXPECT_EQ(time.missed, 0u);
  EXPECT_EQ(time.sequence, 90u);
}

TEST(FrameTimer, GoesOnByTheHostsClockWhenTheDevicesStandsStillOrLeaps) {
  FrameTimer timer(30.0, 0);
  (void)timer.next(stamp(1'000'000, kStart_us));
  const FrameTime frozen = timer.next(stamp(1'000'000, kStart_us + kPeriod_us));
  EXPECT_TRUE(frozen.clock_fault);
  EXPECT_EQ(frozen.device_us, 1'000'000 + kPeriod_us);
  // What a step back of a second looks like after unwrapping 32 bits of 60 MHz.
  const FrameTime leapt = timer.next(stamp(1'000'000 + 70'582'788, kStart_us + 2 * kPeriod_us));
  EXPECT_TRUE(leapt.clock_fault);
  EXPECT_EQ(leapt.device_us, 1'000'000 + 2 * kPeriod_us);
  EXPECT_EQ(leapt.sequence, 2u);
}

TEST(FrameTimer, KeepsTimeOverAReopeningWhoseClockBeginsAnew) {
  FrameTimer timer(30.0, 0);
  const FrameTime before = timer.next(stamp(50'000'000, kStart_us));
  const FrameTime after = timer.next(stamp(12, kStart_us + 2'000'000, 2));
  EXPECT_FALSE(after.clock_fault);
  EXPECT_EQ(after.device_us, before.device_us + 2'000'000);
  EXPECT_EQ(after.exposure_us, before.exposure_us + 2'000'000);
  EXPECT_EQ(after.sequence, before.sequence + 60);
  EXPECT_EQ(after.missed, 0u);
}

}  // namespace
}  // namespace grapnel
