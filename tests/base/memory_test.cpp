// Arena, FixedList, InlineList and Result.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "base/arena.h"
#include "base/error.h"
#include "base/fixed_list.h"

namespace grapnel {
namespace {

struct Block {
  explicit Block(std::size_t bytes)
      : memory(static_cast<std::byte*>(std::aligned_alloc(64, bytes)), &std::free), size(bytes) {}
  [[nodiscard]] std::span<std::byte> span() const { return {memory.get(), size}; }
  std::unique_ptr<std::byte, void (*)(void*)> memory;
  std::size_t size;
};

struct Taken {
  std::span<std::uint8_t> small;
  std::span<double> numbers;
  std::span<std::uint16_t> none;
  std::span<float> more;
};

Taken reserve(Arena& arena) {
  Taken taken;
  taken.small = arena.take<std::uint8_t>(3);
  taken.numbers = arena.take<double>(17);
  taken.none = arena.take<std::uint16_t>(0);
  taken.more = arena.take<float>(16);
  return taken;
}

TEST(Arena, CarvesExactlyWhatItMeasured) {
  Arena measure;
  EXPECT_TRUE(reserve(measure).numbers.empty());
  EXPECT_TRUE(measure.measuring());
  // 3 B, 17 · 8 B and 16 · 4 B, each rounded up to 64.
  EXPECT_EQ(measure.used_bytes(), 64u + 192u + 64u);
  const Block block(measure.used_bytes());
  Arena carve(block.span());
  const Taken taken = reserve(carve);
  EXPECT_EQ(carve.used_bytes(), measure.used_bytes());
  EXPECT_EQ(taken.numbers.size(), 17u);
}

TEST(Arena, HandsOutAlignedPiecesThatDoNotOverlapAndAreZero) {
  const Block block(1024);
  Arena arena(block.span());
  const Taken taken = reserve(arena);
  const auto address = [](const void* p) { return reinterpret_cast<std::uintptr_t>(p); };
  EXPECT_EQ(address(taken.numbers.data()) % 64, 0u);
  EXPECT_EQ(address(taken.more.data()) % 64, 0u);
  EXPECT_GE(address(taken.numbers.data()), address(taken.small.data()) + 3);
  EXPECT_GE(address(taken.more.data()), address(taken.numbers.data()) + 17 * 8);
  for (const double number : taken.numbers) EXPECT_EQ(number, 0.0);
}

TEST(ArenaDeathTest, StopsTheProgramWhenTheBlockIsTooSmall) {
  const Block block(64);
  Arena arena(block.span());
  (void)arena.take<std::byte>(64);
  EXPECT_DEATH((void)arena.take<std::byte>(1), "");
}

TEST(FixedList, RefusesWhatDoesNotFitAndRemembersIt) {
  std::vector<int> storage(2);
  FixedList<int> list{std::span<int>(storage)};
  EXPECT_TRUE(list.push_back(1));
  EXPECT_TRUE(list.push_back(2));
  EXPECT_TRUE(list.full());
  EXPECT_FALSE(list.overflowed());
  EXPECT_FALSE(list.push_back(3));
  EXPECT_TRUE(list.overflowed());
  EXPECT_EQ(std::vector<int>(list.begin(), list.end()), (std::vector<int>{1, 2}));
  list.clear();
  EXPECT_TRUE(list.empty());
  EXPECT_FALSE(list.overflowed());
  EXPECT_EQ(list.capacity(), 2u);
}

TEST(FixedList, WithoutStorageHoldsNothing) {
  FixedList<int> list;
  EXPECT_FALSE(list.push_back(1));
  EXPECT_EQ(list.size(), 0u);
}

TEST(FixedListDeathTest, StopsTheProgramWhenLengthenedBeyondItsStorage) {
  std::vector<int> storage(2);
  FixedList<int> list{std::span<int>(storage)};
  EXPECT_DEATH(list.resize(3), "");
}

TEST(InlineList, CopiesItsElements) {
  InlineList<int, 3> list = {4, 5};
  InlineList<int, 3> copy = list;
  copy[0] = 9;
  EXPECT_EQ(list[0], 4);
  EXPECT_TRUE(copy.push_back(6));
  EXPECT_FALSE(copy.push_back(7));
  EXPECT_TRUE(copy.overflowed());
  EXPECT_EQ(copy.span().size(), 3u);
  EXPECT_EQ(list.size(), 2u);
}

TEST(Result, HoldsAValueOrAnError) {
  Result<std::string> good = std::string("value");
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(good.value(), "value");
  const Result<std::string> bad = Error{Code::RoiEmpty, Stage::Segment, 7};
  ASSERT_FALSE(bad.ok());
  EXPECT_EQ(bad.error(), (Error{Code::RoiEmpty, Stage::Segment, 7}));
  EXPECT_FALSE(static_cast<bool>(bad));
}

TEST(ResultDeathTest, StopsTheProgramWhenTheWrongHalfIsRead) {
  const Result<int> bad = Error{Code::Busy, Stage::None, 0};
  const Result<int> good = 3;
  EXPECT_DEATH((void)bad.value(), "");
  EXPECT_DEATH((void)good.error(), "");
  const Status ok;
  EXPECT_DEATH((void)ok.error(), "");
}

TEST(Stage, HasAName) {
  EXPECT_STREQ(stage_name(Stage::Keypoints), "keypoints");
  EXPECT_STREQ(stage_name(Stage::Recording), "recording");
  EXPECT_STREQ(stage_name(Stage::kCount), "unknown");
}

}  // namespace
}  // namespace grapnel
