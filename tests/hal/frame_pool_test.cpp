#include "hal/frame_pool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <thread>
#include <utility>
#include <vector>

namespace grapnel {
namespace {

constexpr int kWidth = 8;
constexpr int kHeight = 4;

/// Publishes a frame whose every pixel is `sequence`; false when no slot is free.
bool publish(FramePool& pool, std::uint64_t sequence, std::int64_t exposure_us) {
  FramePool::Slot* const slot = pool.begin_write();
  if (slot == nullptr) return false;
  std::fill_n(slot->depth, kWidth * kHeight, static_cast<std::uint16_t>(sequence));
  slot->frame = {};
  slot->frame.depth = {slot->depth, kWidth, kHeight};
  slot->frame.sequence = sequence;
  slot->frame.exposure_us = exposure_us;
  pool.publish(slot);
  return true;
}

TEST(FramePool, HasNothingBeforeTheFirstFrame) {
  FramePool pool(3, kWidth, kHeight, false);
  EXPECT_FALSE(pool.lease_latest().valid());
  EXPECT_FALSE(pool.lease_first_since(0).valid());
  EXPECT_FALSE(pool.lease_nearest(0).valid());
  EXPECT_EQ(pool.published(), 0u);
}

TEST(FramePool, LeasesTheNewestTheFirstSinceAndTheNearest) {
  FramePool pool(4, kWidth, kHeight, true);
  for (std::uint64_t n = 1; n <= 4; ++n) {
    ASSERT_TRUE(publish(pool, n, static_cast<std::int64_t>(n) * 100));
  }
  EXPECT_EQ(pool.lease_latest().frame().sequence, 4u);
  EXPECT_EQ(pool.lease_first_since(0).frame().sequence, 1u);
  EXPECT_EQ(pool.lease_first_since(200).frame().sequence, 2u);
  EXPECT_EQ(pool.lease_first_since(201).frame().sequence, 3u);
  EXPECT_FALSE(pool.lease_first_since(401).valid());
  EXPECT_EQ(pool.lease_nearest(249).frame().sequence, 2u);
  EXPECT_EQ(pool.lease_nearest(251).frame().sequence, 3u);
  EXPECT_EQ(pool.lease_nearest(250).frame().sequence, 3u) << "the newer of two as near";
  EXPECT_EQ(pool.lease_nearest(-5000).frame().sequence, 1u);
}

TEST(FramePool, OverwritesTheOldestFrameThatNobodyHolds) {
  FramePool pool(3, kWidth, kHeight, false);
  ASSERT_TRUE(publish(pool, 1, 100));
  const FrameLease held = pool.lease_latest();
  for (std::uint64_t n = 2; n <= 9; ++n) {
    ASSERT_TRUE(publish(pool, n, static_cast<std::int64_t>(n) * 100));
  }
  EXPECT_EQ(held.frame().sequence, 1u);
  EXPECT_EQ(held.frame().depth.at(7, 3), 1);
  EXPECT_EQ(pool.lease_latest().frame().sequence, 9u);
  EXPECT_EQ(pool.lease_first_since(200).frame().sequence, 8u) << "two slots were left to turn";
}

TEST(FramePool, HasNoSlotWhenAllAreHeldAndOneAgainAfterARelease) {
  FramePool pool(2, kWidth, kHeight, false);
  ASSERT_TRUE(publish(pool, 1, 100));
  FrameLease first = pool.lease_latest();
  ASSERT_TRUE(publish(pool, 2, 200));
  const FrameLease second = pool.lease_latest();
  EXPECT_FALSE(publish(pool, 3, 300));
  pool.count_drop();
  EXPECT_EQ(pool.dropped(), 1u);
  first.release();
  EXPECT_FALSE(first.valid());
  EXPECT_TRUE(publish(pool, 4, 400));
  EXPECT_EQ(second.frame().sequence, 2u);
}

TEST(FramePool, CountsAFrameHeldTwiceUntilBothAreGone) {
  FramePool pool(2, kWidth, kHeight, false);
  ASSERT_TRUE(publish(pool, 1, 100));
  FrameLease a = pool.lease_latest();
  FrameLease b = pool.lease_latest();
  ASSERT_TRUE(publish(pool, 2, 200));
  const FrameLease c = pool.lease_latest();
  a.release();
  EXPECT_FALSE(publish(pool, 3, 300));
  b = FrameLease();
  EXPECT_TRUE(publish(pool, 3, 300));
}

TEST(FramePool, MovesALeaseWithoutDoublingIt) {
  FramePool pool(2, kWidth, kHeight, false);
  ASSERT_TRUE(publish(pool, 1, 100));
  FrameLease a = pool.lease_latest();
  FrameLease b = std::move(a);
  EXPECT_FALSE(a.valid());  // NOLINT(bugprone-use-after-move): what a moved lease is, is promised
  FrameLease& alias = b;
  b = std::move(alias);
  EXPECT_EQ(b.frame().sequence, 1u);
  b.release();
  ASSERT_TRUE(publish(pool, 2, 200));
  EXPECT_TRUE(publish(pool, 3, 300));
}

TEST(FramePool, DiscardsASlotAsIfItHadNeverBeen) {
  FramePool pool(2, kWidth, kHeight, false);
  ASSERT_TRUE(publish(pool, 1, 100));
  FramePool::Slot* const slot = pool.begin_write();
  ASSERT_NE(slot, nullptr);
  pool.discard(slot);
  EXPECT_EQ(pool.published(), 1u);
  EXPECT_EQ(pool.lease_latest().frame().sequence, 1u);
}

TEST(FramePool, ForgetsAllButTheHeldFrames) {
  FramePool pool(3, kWidth, kHeight, false);
  ASSERT_TRUE(publish(pool, 1, 100));
  ASSERT_TRUE(publish(pool, 2, 200));
  const FrameLease held = pool.lease_nearest(100);
  pool.invalidate();
  EXPECT_EQ(held.frame().sequence, 1u);
  EXPECT_FALSE(pool.lease_first_since(200).valid());
}

TEST(FramePool, WakesWaitersAtEachPublication) {
  FramePool pool(2, kWidth, kHeight, false);
  const std::uint32_t seen = pool.published_signal().version();
  ASSERT_TRUE(publish(pool, 1, 100));
  EXPECT_TRUE(pool.published_signal().wait(seen, 0));
  const std::uint32_t again = pool.published_signal().version();
  pool.wake();
  EXPECT_TRUE(pool.published_signal().wait(again, 0));
}

TEST(FramePool, StatesTheBytesOfItsImages) {
  const FramePool depth(3, kWidth, kHeight, false);
  const FramePool color(3, kWidth, kHeight, true);
  EXPECT_EQ(color.bytes() - depth.bytes(), 3u * kWidth * kHeight * sizeof(Rgb8));
  EXPECT_GE(depth.bytes(), 3u * kWidth * kHeight * sizeof(std::uint16_t));
}

TEST(FramePool, NeverShowsAReaderAFrameThatChangesUnderIt) {
  constexpr std::uint64_t kFrames = 20'000;
  constexpr int kReaders = 3;
  FramePool pool(5, kWidth, kHeight, false);
  std::atomic<bool> done{false};
  std::atomic<std::uint64_t> leases{0};
  std::vector<std::thread> readers;
  for (int reader = 0; reader < kReaders; ++reader) {
    readers.emplace_back([&, reader] {
      std::uint64_t newest = 0;
      for (std::int64_t look = 0; !done; ++look) {
        FrameLease lease;
        if (reader == 0) lease = pool.lease_latest();
        if (reader == 1) lease = pool.lease_first_since(look % static_cast<std::int64_t>(kFrames));
        if (reader == 2) lease = pool.lease_nearest(static_cast<std::int64_t>(pool.published()));
        if (!lease.valid()) continue;
        ++leases;
        const DepthFrame& frame = lease.frame();
        const std::uint64_t sequence = frame.sequence;
        for (int round = 0; round < 2; ++round) {
          for (int v = 0; v < kHeight; ++v) {
            for (int u = 0; u < kWidth; ++u) {
              ASSERT_EQ(frame.depth.at(u, v), static_cast<std::uint16_t>(sequence));
            }
          }
        }
        if (reader != 0) continue;
        ASSERT_GE(sequence, newest) << "the newest frame never goes back";
        newest = sequence;
      }
    });
  }
  std::uint64_t published = 0;
  for (std::uint64_t n = 1; n <= kFrames; ++n) {
    if (publish(pool, n, static_cast<std::int64_t>(n))) ++published;
    if (n % 64 == 0) std::this_thread::yield();
  }
  while (leases.load() < 100) std::this_thread::yield();
  done = true;
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(pool.published(), published);
  EXPECT_GT(published, kFrames / 2);
}

}  // namespace
}  // namespace grapnel
