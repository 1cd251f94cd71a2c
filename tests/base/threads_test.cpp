// Latest, LogRing, Signal and the clocks, with the threads they are made for.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include "base/clock.h"
#include "base/log.h"
#include "base/mailbox.h"
#include "base/signal.h"

namespace grapnel {
namespace {

struct Wide {
  std::array<std::uint64_t, 32> words{};
};

TEST(Latest, GivesOnlyTheNewestValueAndOnlyOnce) {
  Latest<int> box;
  EXPECT_FALSE(box.update());
  box.publish(1);
  box.publish(2);
  EXPECT_TRUE(box.update());
  EXPECT_EQ(box.get(), 2);
  EXPECT_FALSE(box.update());
  EXPECT_EQ(box.get(), 2);
  box.publish(3);
  EXPECT_TRUE(box.update());
  EXPECT_EQ(box.get(), 3);
}

TEST(Latest, NeverShowsATornOrAnOlderValue) {
  constexpr std::uint64_t kValues = 100'000;
  Latest<Wide> box;
  std::thread writer([&] {
    for (std::uint64_t value = 1; value <= kValues; ++value) {
      box.writable().words.fill(value);
      box.publish();
    }
  });
  std::uint64_t last = 0;
  while (last < kValues) {
    if (!box.update()) {
      std::this_thread::yield();
      continue;
    }
    const Wide& value = box.get();
    ASSERT_GT(value.words.front(), last);
    for (const std::uint64_t word : value.words) ASSERT_EQ(word, value.words.front());
    last = value.words.front();
  }
  writer.join();
}

TEST(LogRing, KeepsOrderAndCountsWhatItLost) {
  const ManualClock clock(77);
  const auto ring = std::make_unique<LogRing>(clock);
  constexpr std::int64_t kPushed = 1500;
  for (std::int64_t i = 0; i < kPushed; ++i) {
    ring->push(LogLevel::Warning, Stage::Capture, Code::LostPackets, "lost {}", i, 2, 3);
  }
  EXPECT_EQ(ring->lost(), static_cast<std::uint64_t>(kPushed) - LogRing::kCapacity);
  LogEvent event;
  for (std::int64_t i = 0; i < static_cast<std::int64_t>(LogRing::kCapacity); ++i) {
    ASSERT_TRUE(ring->pop(event));
    ASSERT_EQ(event.numbers[0], i);
  }
  EXPECT_EQ(event.time_us, 77);
  EXPECT_EQ(event.code, Code::LostPackets);
  EXPECT_EQ(event.level, LogLevel::Warning);
  EXPECT_STREQ(event.text, "lost {}");
  EXPECT_FALSE(ring->pop(event));
  ring->push(LogLevel::Info, Stage::None, Code::Ok, "again");
  EXPECT_TRUE(ring->pop(event));
}

TEST(LogRing, LosesNothingUnsaidBetweenManyWriters) {
  constexpr int kWriters = 3;
  constexpr std::int64_t kEach = 20'000;
  const MonotonicClock clock;
  const auto ring = std::make_unique<LogRing>(clock);
  std::atomic<int> running{kWriters};
  std::vector<std::thread> writers;
  for (int writer = 0; writer < kWriters; ++writer) {
    writers.emplace_back([&, writer] {
      for (std::int64_t i = 0; i < kEach; ++i) {
        ring->push(LogLevel::Info, Stage::None, Code::Ok, "x", writer, i);
      }
      --running;
    });
  }
  std::array<std::int64_t, kWriters> last;
  last.fill(-1);
  std::uint64_t popped = 0;
  LogEvent event;
  for (;;) {
    const bool done = running.load() == 0;
    if (!ring->pop(event)) {
      if (done) break;
      std::this_thread::yield();
      continue;
    }
    ++popped;
    std::int64_t& previous = last[static_cast<std::size_t>(event.numbers[0])];
    ASSERT_GT(event.numbers[1], previous) << "each writer's events stay in order";
    previous = event.numbers[1];
  }
  for (std::thread& writer : writers) writer.join();
  EXPECT_EQ(popped + ring->lost(), static_cast<std::uint64_t>(kWriters * kEach));
}

TEST(Signal, ReturnsAtOnceWhenTheVersionHasPassed) {
  Signal signal;
  const std::uint32_t seen = signal.version();
  signal.notify();
  EXPECT_TRUE(signal.wait(seen, 0));
  EXPECT_FALSE(signal.wait(signal.version(), 0));
}

TEST(Signal, GivesUpAfterItsTime) {
  const Signal signal;
  const MonotonicClock clock;
  const std::int64_t begin_us = clock.now_us();
  while (!signal.wait(signal.version(), 20'000) && clock.now_us() - begin_us < 20'000) {
  }
  EXPECT_GE(clock.now_us() - begin_us, 20'000);
}

TEST(Signal, WakesASleepingThreadEachTime) {
  Signal ping;
  Signal pong;
  std::atomic<int> value{0};
  constexpr int kRounds = 500;
  std::thread other([&] {
    for (int round = 1; round <= kRounds; ++round) {
      for (std::uint32_t seen = ping.version(); value.load() != 2 * round - 1;
           seen = ping.version()) {
        ping.wait(seen, 1'000'000);
      }
      ++value;
      pong.notify();
    }
  });
  for (int round = 1; round <= kRounds; ++round) {
    ++value;
    ping.notify();
    for (std::uint32_t seen = pong.version(); value.load() != 2 * round; seen = pong.version()) {
      pong.wait(seen, 1'000'000);
    }
  }
  other.join();
  EXPECT_EQ(value.load(), 2 * kRounds);
}

TEST(MonotonicClock, GoesForwardAndSleepsAtLeastAsLongAsAsked) {
  const MonotonicClock clock;
  const std::int64_t begin_us = clock.now_us();
  clock.sleep_until_us(begin_us + 3'000);
  EXPECT_GE(clock.now_us(), begin_us + 3'000);
  clock.sleep_until_us(begin_us);
}

TEST(ManualClock, WakesASleeperOnlyWhenItWasTurnedFarEnough) {
  ManualClock clock(1000);
  std::atomic<bool> awake{false};
  std::thread sleeper([&] {
    clock.sleep_until_us(1500);
    awake = true;
  });
  clock.advance_us(499);
  EXPECT_EQ(clock.now_us(), 1499);
  EXPECT_FALSE(awake.load());
  clock.advance_us(1);
  sleeper.join();
  EXPECT_TRUE(awake.load());
}

}  // namespace
}  // namespace grapnel
