#include "firmware_app/encoder_track.h"

#include <gtest/gtest.h>

namespace grapnel {
namespace {

TEST(EncoderTrack, IsLinearBetweenTwoCounts) {
  EncoderTrack track;
  track.add(500, 100'000);
  track.add(540, 120'000);
  EXPECT_EQ(track.at(100'000), 500U);
  EXPECT_EQ(track.at(105'000), 510U);
  EXPECT_EQ(track.at(120'000), 540U);
}

TEST(EncoderTrack, KnowsNothingOutsideTheStream) {
  EncoderTrack track;
  EXPECT_FALSE(track.at(0));
  track.add(500, 100'000);
  EXPECT_FALSE(track.at(100'000));
  track.add(540, 120'000);
  EXPECT_FALSE(track.at(99'999));
  EXPECT_FALSE(track.at(120'001));
}

TEST(EncoderTrack, DoesNotGuessAcrossAGap) {
  EncoderTrack track;
  track.add(500, 100'000);
  track.add(540, 100'000 + EncoderTrack::kLongestGapUs + 1);
  EXPECT_FALSE(track.at(110'000));
}

TEST(EncoderTrack, FollowsABeltBackwardsAndOverTheEndOfTheCount) {
  EncoderTrack track;
  track.add(0xfffffff0U, 100'000);
  track.add(0x10U, 120'000);
  EXPECT_EQ(track.at(110'000), 0U);
  track.add(0xfffffff0U, 140'000);
  EXPECT_EQ(track.at(135'000), 0xfffffff8U);
}

TEST(EncoderTrack, HoldsSecondsOfAFastStream) {
  EncoderTrack track;
  for (std::uint32_t ms = 0; ms < 60'000; ++ms) track.add(ms, std::int64_t{1000} * ms);
  EXPECT_EQ(track.at(55'005'000), 55'005U);
  EXPECT_FALSE(track.at(1'000'000));
}

}  // namespace
}  // namespace grapnel
