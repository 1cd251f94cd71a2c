// What hal/camera.h promises, held against every driver of the list.
#include "tests/contract/camera_contract.h"

#include <algorithm>
#include <iostream>
#include <thread>
#include <vector>

#include "tests/support/heap_guard.h"

namespace grapnel::test {
namespace {

constexpr std::int64_t kPatience_us = 10'000'000;
constexpr std::int64_t kLook_us = 20'000;
// Long enough for five frames at the slowest rate a driver under test may have.
constexpr std::int64_t kQuiet_us = 250'000;

}  // namespace

CaptureHooks CaptureWatch::hooks() noexcept {
  CaptureHooks hooks;
  hooks.thread_started = [](void* self) noexcept {
    static_cast<CaptureWatch*>(self)->on_started();
  };
  hooks.progress = [](void* self) noexcept { static_cast<CaptureWatch*>(self)->on_progress(); };
  hooks.context = this;
  return hooks;
}

void CaptureWatch::on_started() noexcept {
  ++started_;
  last_us_ = clock_.now_us();
  arm_heap_guard();
}

void CaptureWatch::on_progress() noexcept {
  heap_calls_ = test::heap_calls();
  const std::int64_t now_us = clock_.now_us();
  const std::int64_t gap_us = now_us - last_us_.exchange(now_us);
  if (gap_us > longest_gap_us_) longest_gap_us_ = gap_us;
  ++progress_;
}

void CameraContract::SetUp() {
  driver_ = GetParam().prepare();
  camera_ = driver_->make(clock_);
  ASSERT_NE(camera_, nullptr);
}

FramePool* CameraContract::make_pool(std::size_t slots) {
  const CameraInfo info = driver_->declared();
  pools_.push_back(std::make_unique<FramePool>(slots, info.intrinsics.width, info.intrinsics.height,
                                               info.has_color));
  return pools_.back().get();
}

bool CameraContract::wait_for(FramePool& pool, const std::function<bool()>& done) {
  const MonotonicClock clock;
  const std::int64_t until_us = clock.now_us() + kPatience_us;
  while (clock.now_us() < until_us) {
    const std::uint32_t seen = pool.published_signal().version();
    if (done()) return true;
    pool.published_signal().wait(seen, kLook_us);
  }
  return done();
}

bool CameraContract::wait_for_frames(FramePool& pool, std::uint64_t more) {
  const std::uint64_t target = pool.published() + more;
  return wait_for(pool, [&] { return pool.published() >= target; });
}

TEST_P(CameraContract, OpensAsDeclaredAndAnswersTheSameWhenOpenedAgain) {
  EXPECT_EQ(camera_->status().state, CameraState::Closed);
  const CameraInfo declared = driver_->declared();
  for (int round = 0; round < 2; ++round) {
    const Result<CameraInfo> info = camera_->open();
    ASSERT_TRUE(info.ok()) << camera_->problem();
    EXPECT_EQ(info.value().driver, declared.driver);
    EXPECT_EQ(info.value().serial, declared.serial);
    EXPECT_EQ(info.value().intrinsics, declared.intrinsics);
    EXPECT_TRUE(info.value().intrinsics.valid());
    EXPECT_EQ(info.value().metres_per_unit, declared.metres_per_unit);
    EXPECT_EQ(info.value().baseline_m, declared.baseline_m);
    EXPECT_EQ(info.value().has_color, declared.has_color);
    EXPECT_EQ(info.value().live, declared.live);
    EXPECT_GT(info.value().nominal_rate_hz, 0.0);
  }
  EXPECT_EQ(camera_->status().state, CameraState::Opened);
  EXPECT_EQ(camera_->status().code, Code::SensorHealthy);
}

TEST_P(CameraContract, RefusesToStartBeforeItIsOpenAndAfterItIsClosed) {
  FramePool* const pool = make_pool(3);
  const Status before = camera_->start(*pool, {});
  ASSERT_FALSE(before.ok());
  EXPECT_EQ(before.error().code, Code::SensorNotConnected);
  ASSERT_TRUE(camera_->open().ok());
  camera_->close();
  const Status after = camera_->start(*pool, {});
  ASSERT_FALSE(after.ok());
  EXPECT_EQ(after.error().code, Code::SensorNotConnected);
  EXPECT_EQ(pool->published(), 0u);
}

TEST_P(CameraContract, RefusesAPoolThatIsTooSmall) {
  ASSERT_TRUE(camera_->open().ok());
  const Intrinsics intrinsics = driver_->declared().intrinsics;
  FramePool narrow(3, intrinsics.width - 1, intrinsics.height, true);
  FramePool low(3, intrinsics.width, intrinsics.height - 1, true);
  EXPECT_FALSE(camera_->start(narrow, {}).ok());
  EXPECT_FALSE(camera_->start(low, {}).ok());
  FramePool* const pool = make_pool(3);
  EXPECT_TRUE(camera_->start(*pool, {}).ok());
}

TEST_P(CameraContract, DeliversFramesInOrderWithEverythingDeclared) {
  const CameraInfo declared = driver_->declared();
  FramePool* const pool = make_pool(4);
  ASSERT_TRUE(camera_->open().ok());
  ASSERT_TRUE(camera_->start(*pool, {}).ok());
  std::int64_t exposure_us = 0;
  std::int64_t device_us = 0;
  std::uint64_t sequence = 0;
  bool color_seen = false;
  for (int i = 0; i < 12; ++i) {
    FrameLease lease;
    ASSERT_TRUE(wait_for(*pool, [&] {
      lease = pool->lease_latest();
      return lease.valid() && (i == 0 || lease.frame().sequence != sequence);
    }));
    const DepthFrame& frame = lease.frame();
    ASSERT_EQ(frame.depth.width, declared.intrinsics.width);
    ASSERT_EQ(frame.depth.height, declared.intrinsics.height);
    EXPECT_EQ(frame.intrinsics, declared.intrinsics);
    EXPECT_EQ(frame.metres_per_unit, declared.metres_per_unit);
    EXPECT_EQ(frame.baseline_m, declared.baseline_m);
    EXPECT_EQ(frame.recorded, !declared.live);
    EXPECT_LE(frame.exposure_us, clock_.now_us());
    color_seen |= !frame.color.empty();
    if (i > 0) {
      EXPECT_GT(frame.sequence, sequence);
      EXPECT_GT(frame.exposure_us, exposure_us);
      EXPECT_GT(frame.device_us, device_us);
    }
    sequence = frame.sequence;
    exposure_us = frame.exposure_us;
    device_us = frame.device_us;
  }
  EXPECT_EQ(color_seen, declared.has_color);
  EXPECT_EQ(camera_->status().state, CameraState::Streaming);
}

TEST_P(CameraContract, PublishesNothingAfterStop) {
  FramePool* const pool = make_pool(3);
  ASSERT_TRUE(camera_->open().ok());
  ASSERT_TRUE(camera_->start(*pool, {}).ok());
  ASSERT_TRUE(wait_for_frames(*pool, 3));
  camera_->stop();
  const std::uint64_t published = pool->published();
  const std::uint32_t version = pool->published_signal().version();
  EXPECT_FALSE(pool->published_signal().wait(version, kQuiet_us));
  EXPECT_EQ(pool->published(), published);
  EXPECT_EQ(camera_->status().counters.frames, published);
  EXPECT_EQ(camera_->status().state, CameraState::Opened);
}

TEST_P(CameraContract, StartsAgainAfterStopAndGoesOnCounting) {
  FramePool* const pool = make_pool(3);
  ASSERT_TRUE(camera_->open().ok());
  std::uint64_t sequence = 0;
  std::int64_t exposure_us = 0;
  for (int round = 0; round < 4; ++round) {
    ASSERT_TRUE(camera_->start(*pool, {}).ok());
    ASSERT_TRUE(wait_for_frames(*pool, 2));
    camera_->stop();
    const FrameLease lease = pool->lease_latest();
    ASSERT_TRUE(lease.valid());
    if (round > 0) {
      EXPECT_GT(lease.frame().sequence, sequence);
      EXPECT_GT(lease.frame().exposure_us, exposure_us);
    }
    sequence = lease.frame().sequence;
    exposure_us = lease.frame().exposure_us;
  }
}

TEST_P(CameraContract, OpensAgainAfterClose) {
  FramePool* const pool = make_pool(3);
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE(camera_->open().ok());
    ASSERT_TRUE(camera_->start(*pool, {}).ok());
    ASSERT_TRUE(wait_for_frames(*pool, 1));
    camera_->close();
    EXPECT_EQ(camera_->status().state, CameraState::Closed);
  }
}

TEST_P(CameraContract, TakesNoHarmFromCallsOutOfOrder) {
  FramePool* const pool = make_pool(3);
  camera_->stop();
  camera_->close();
  camera_->close();
  ASSERT_TRUE(camera_->open().ok());
  camera_->stop();
  ASSERT_TRUE(camera_->start(*pool, {}).ok());
  const Status again = camera_->start(*pool, {});
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, Code::Busy);
  ASSERT_TRUE(wait_for_frames(*pool, 2));
  camera_->stop();
  camera_->stop();
  ASSERT_TRUE(camera_->start(*pool, {}).ok());
  camera_->close();
  camera_->stop();
  EXPECT_EQ(camera_->status().state, CameraState::Closed);
  ASSERT_TRUE(camera_->open().ok());
  ASSERT_TRUE(camera_->start(*pool, {}).ok());
  camera_.reset();
}

TEST_P(CameraContract, CountsTheFramesThatFindNoFreeSlotAndLeavesLeasedOnesAlone) {
  FramePool* const pool = make_pool(2);
  ASSERT_TRUE(camera_->open().ok());
  ASSERT_TRUE(camera_->start(*pool, {}).ok());
  FrameLease first;
  FrameLease second;
  ASSERT_TRUE(wait_for(*pool, [&] {
    first = pool->lease_latest();
    return first.valid();
  }));
  ASSERT_TRUE(wait_for(*pool, [&] {
    second = pool->lease_latest();
    return second.frame().sequence != first.frame().sequence;
  }));
  const std::uint64_t held = second.frame().sequence;
  const ImageView<const std::uint16_t> depth = second.frame().depth;
  const std::vector<std::uint16_t> copy(depth.data, depth.data + depth.pixels());
  const std::uint64_t dropped = camera_->status().counters.dropped;
  ASSERT_TRUE(wait_for(*pool, [&] { return camera_->status().counters.dropped >= dropped + 3; }));
  EXPECT_EQ(second.frame().sequence, held);
  EXPECT_TRUE(std::equal(copy.begin(), copy.end(), depth.data));
  first.release();
  second.release();
  ASSERT_TRUE(wait_for_frames(*pool, 1));
  camera_->stop();
  EXPECT_EQ(camera_->status().counters.dropped, pool->dropped());
  const FrameLease next = pool->lease_latest();
  EXPECT_GE(next.frame().sequence, held + 3) << "lost frames leave a gap in the sequence";
}

TEST_P(CameraContract, TellsItsStatusToAnyThreadWhileItWorks) {
  FramePool* const pool = make_pool(3);
  std::atomic<bool> done{false};
  std::thread watcher([&] {
    std::uint64_t frames = 0;
    while (!done) {
      const CameraStatus status = camera_->status();
      EXPECT_GE(status.counters.frames, frames);
      frames = status.counters.frames;
      std::this_thread::yield();
    }
  });
  EXPECT_TRUE(camera_->open().ok());
  for (int round = 0; round < 3; ++round) {
    EXPECT_TRUE(camera_->start(*pool, {}).ok());
    EXPECT_TRUE(wait_for_frames(*pool, 2));
    camera_->stop();
  }
  camera_->close();
  done = true;
  watcher.join();
}

TEST_P(CameraContract, ShowsItsCaptureThreadAlive) {
  CaptureWatch watch;
  FramePool* const pool = make_pool(3);
  ASSERT_TRUE(camera_->open().ok());
  ASSERT_TRUE(camera_->start(*pool, watch.hooks()).ok());
  ASSERT_TRUE(wait_for_frames(*pool, 10));
  EXPECT_EQ(watch.threads_started(), 1);
  EXPECT_GT(watch.progress_calls(), 0u);
  camera_->stop();
  const std::uint64_t calls = watch.progress_calls();
  ASSERT_TRUE(camera_->start(*pool, watch.hooks()).ok());
  ASSERT_TRUE(wait_for(*pool, [&] { return watch.progress_calls() > calls; }));
  camera_->stop();
  EXPECT_EQ(watch.threads_started(), 2);
}

TEST_P(CameraContract, MakesNoHeapCallOnItsCaptureThread) {
  if (!heap_guard_works()) GTEST_SKIP() << kNoHeapGuard;
  clear_first_heap_call();
  CaptureWatch watch;
  FramePool* const pool = make_pool(3);
  ASSERT_TRUE(camera_->open().ok());
  ASSERT_TRUE(camera_->start(*pool, watch.hooks()).ok());
  ASSERT_TRUE(wait_for_frames(*pool, 20));
  // What the capture library and its threads do is theirs: measured, and said apart.
  const std::uint64_t frames = pool->published();
  const std::uint64_t calls = heap_calls_of_all();
  ASSERT_TRUE(!driver_->declared().live || wait_for_frames(*pool, 30));
  const double others = static_cast<double>(heap_calls_of_all() - calls) /
                        static_cast<double>(std::max<std::uint64_t>(pool->published() - frames, 1));
  camera_->stop();
  EXPECT_GT(watch.progress_calls(), 0u);
  EXPECT_EQ(watch.heap_calls(), 0u) << first_heap_call();
  if (driver_->declared().live)
    std::cout << "heap calls a frame outside the capture thread: " << others << "\n";
}

TEST_P(CameraLossContract, GetsALostDeviceBackByItself) {
  FramePool* const pool = make_pool(3);
  ASSERT_TRUE(camera_->open().ok());
  ASSERT_TRUE(camera_->start(*pool, {}).ok());
  ASSERT_TRUE(wait_for_frames(*pool, 2));
  driver_->lose_device(*camera_);
  ASSERT_TRUE(wait_for(*pool, [&] { return camera_->status().state == CameraState::Lost; }));
  const Code code = camera_->status().code;
  EXPECT_NE(code, Code::SensorHealthy);
  EXPECT_EQ(static_cast<int>(code) / 100, 20) << "an error code of the sensor";
  EXPECT_NE(camera_->problem(), "");
  const std::uint64_t sequence = pool->lease_latest().frame().sequence;
  driver_->return_device(*camera_);
  ASSERT_TRUE(wait_for(*pool, [&] { return camera_->status().state == CameraState::Streaming; }));
  ASSERT_TRUE(wait_for_frames(*pool, 2));
  EXPECT_GT(pool->lease_latest().frame().sequence, sequence);
  EXPECT_EQ(camera_->status().code, Code::SensorHealthy);
  EXPECT_GE(camera_->status().counters.reconnects, 1u);
}

TEST_P(CameraLossContract, StopsWhileItsDeviceIsLost) {
  FramePool* const pool = make_pool(3);
  ASSERT_TRUE(camera_->open().ok());
  ASSERT_TRUE(camera_->start(*pool, {}).ok());
  driver_->lose_device(*camera_);
  ASSERT_TRUE(wait_for(*pool, [&] { return camera_->status().state == CameraState::Lost; }));
  camera_->stop();
  EXPECT_NE(camera_->status().state, CameraState::Streaming);
}

}  // namespace grapnel::test
