#include "pipeline/preprocess/row_bands.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <utility>
#include <vector>

#include "base/rng.h"
#include "pipeline/preprocess/background.h"
#include "pipeline/preprocess/median.h"
#include "pipeline/preprocess/organize.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;

Limits limits() {
  Limits limits;
  limits.max_width = kWidth;
  limits.max_height = kHeight;
  return limits;
}

struct Bands {
  WorkingDepth work;
  RowBands bands;
  DepthMedian median{{}};
  BackgroundRemoval background{{}};
  test::ArenaMemory memory;

  Bands()
      : memory([&](Arena& arena) {
          work.reserve(arena, limits());
          bands.reserve(arena, limits());
          median.reserve(arena, limits());
          background.reserve(arena, limits());
        }) {}

  /// An image of readings at 1 m without labels.
  void clear() {
    test::TestFrame frame(kWidth, kHeight, 300.0);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) frame.at(u, v) = 1000;
    }
    ASSERT_TRUE(organize(frame.frame, {}, work).ok());
    for (int v = 0; v < kHeight; ++v) {
      std::fill_n(work.label.row(v), kWidth, kNoLabel);
    }
  }
};

TEST(RowBands, CoverWhatIsLabelledAndTheMarginAroundIt) {
  Rng rng(12);
  for (int round = 0; round < 50; ++round) {
    Bands b;
    b.clear();
    std::vector<std::pair<int, int>> labelled;
    for (std::uint32_t i = 0; i < 1 + rng.below(4); ++i) {
      const int u = static_cast<int>(rng.below(kWidth));
      const int v = static_cast<int>(rng.below(kHeight));
      b.work.label.row(v)[u] = kForeground;
      labelled.emplace_back(u, v);
    }
    b.bands.cover_labels(b.work);
    for (int v = 0; v < kHeight; ++v) {
      const RowBands::Columns columns = b.bands.at(v);
      EXPECT_GE(columns.begin, 0);
      EXPECT_LE(columns.end, kWidth);
      bool near = false;
      for (const auto& [lu, lv] : labelled) {
        // Whole bands: at most one more than the margin.
        near = near || std::abs(lv - v) <= RowBands::kMargin_px + RowBands::kRows;
        if (std::abs(lv - v) > RowBands::kMargin_px) continue;
        EXPECT_LE(columns.begin, std::max(0, lu - RowBands::kMargin_px));
        EXPECT_GE(columns.end, std::min(kWidth, lu + RowBands::kMargin_px + 1));
      }
      if (!near) {
        EXPECT_EQ(columns.width(), 0) << v;
      }
    }
  }
}

TEST(RowBands, AreEmptyWithoutLabelsAndWholeWhenAllIsCovered) {
  Bands b;
  b.clear();
  b.bands.cover_labels(b.work);
  for (int v = 0; v < kHeight; ++v) EXPECT_EQ(b.bands.at(v).width(), 0);
  b.bands.cover(b.work);
  for (int v = 0; v < kHeight; ++v) EXPECT_EQ(b.bands.at(v).width(), kWidth);
}

/// A noisy table with a block on it, specks on both and above the table.
test::TestFrame noisy_table() {
  test::TestFrame frame(kWidth, kHeight, 300.0);
  const Vec3d tilted = Vec3d(0.05, -0.3, -1.0).normalized();
  frame.draw_plane(tilted, 1.0, 0, 0, kWidth, kHeight);
  frame.draw_plane(tilted, 0.9, 120, 90, 190, 150);
  Rng rng(3);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      if (frame.at(u, v) == 0) continue;
      // 2 mm to either side, far below the 8 mm at which something stands on the table.
      frame.at(u, v) = static_cast<std::uint16_t>(frame.at(u, v) + rng.below(5) - 2);
      if (rng.below(4000) == 0) frame.at(u, v) = static_cast<std::uint16_t>(850 + rng.below(50));
    }
  }
  return frame;
}

TEST(RowBands, TheMedianOfTheForegroundAloneLabelsAsThatOfTheWholeImage) {
  const test::TestFrame frame = noisy_table();
  Bands whole;
  ASSERT_TRUE(organize(frame.frame, {}, whole.work).ok());
  whole.median.apply(whole.work);
  Rng rng(1);
  const BackgroundReport expected = whole.background.apply(whole.work, {}, 0.0, rng);

  Bands part;
  ASSERT_TRUE(organize(frame.frame, {}, part.work).ok());
  Rng again(1);
  BackgroundReport report = part.background.apply(part.work, {}, 0.0, again);
  const std::size_t before = report.foreground;
  part.bands.cover_labels(part.work);
  part.median.apply(part.work, part.bands);
  part.background.apply_again(part.work, {}, part.bands, report);

  EXPECT_GT(before, report.foreground) << "specks are gone";
  ASSERT_EQ(report.plane_count, expected.plane_count);
  std::size_t differ = 0;
  std::size_t foreground = 0;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const bool is = part.work.label.at(u, v) == kForeground;
      foreground += is ? 1U : 0U;
      if (is != (whole.work.label.at(u, v) == kForeground)) ++differ;
      if (is) {
        EXPECT_EQ(part.work.depth.at(u, v), whole.work.depth.at(u, v));
      }
    }
  }
  EXPECT_EQ(foreground, report.foreground);
  EXPECT_GT(foreground, 3000U);
  // Both find the same plane but for noise, so a pixel of the block's foot may change sides.
  EXPECT_LT(differ, 20U);
}

}  // namespace
}  // namespace grapnel
