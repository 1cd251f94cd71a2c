#include "pipeline/kernels/block_pairs.h"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/reference.h"
#include "pipeline/kernels/target.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

constexpr std::int32_t kPoints = 300;
constexpr float kSquared_m2 = 0.002F;
constexpr std::array<PointRange, 3> kRanges = {PointRange{0, 41}, {50, 50}, {57, kPoints}};
constexpr std::array<kernels::BlockOfPoints, 4> kBlocks = {
    kernels::BlockOfPoints{0, 8}, {13, 5}, {100, 1}, {kPoints - 3, 3}};

/// Every test runs on each target that this machine has, against the plain loops: the same bits.
class BlockPairs : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }

  BlockPairs() {
    Rng rng(15);
    for (std::size_t i = 0; i < surface_->size; ++i) {
      surface_->x[i] += static_cast<float>(0.01 * rng.normal());
    }
    // A pair without features.
    surface_->x[1] = surface_->x[0];
    surface_->y[1] = surface_->y[0];
    surface_->z[1] = surface_->z[0];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      planes_[axis].assign(kPoints + kernels::kSlack, 0.0F);
    }
    for (std::size_t i = 0; i < surface_->size; ++i) {
      const Vec3f p = surface_->point(i);
      const Vec3f n = surface_->normal(i);
      rows_.insert(rows_.end(), {p.x(), p.y(), p.z(), n.x(), n.y(), n.z(), 0.0F, 0.0F});
      for (std::size_t axis = 0; axis < 3; ++axis) {
        planes_[axis][i] = p[static_cast<Eigen::Index>(axis)];
      }
    }
  }

  /// What is near a point, by plain loops.
  struct Around {
    std::vector<std::int32_t> position;
    std::vector<float> squared_m2;
  };
  Around around(std::int32_t point) const {
    const auto i = static_cast<std::size_t>(point);
    const kernels::Sphere sphere{planes_[0][i], planes_[1][i], planes_[2][i], kSquared_m2};
    Around found{std::vector<std::int32_t>(kPoints + kernels::kSlack),
                 std::vector<float>(kPoints + kernels::kSlack)};
    const std::size_t size = kernels::reference::select_within(
        points(), kRanges, sphere, found.position.data(), found.squared_m2.data());
    found.position.resize(size);
    found.squared_m2.resize(size);
    return found;
  }
  kernels::PointPlanes points() const {
    return {planes_[0].data(), planes_[1].data(), planes_[2].data()};
  }
  /// Fills near_ for a block.
  [[nodiscard]] bool find(const kernels::BlockOfPoints& block, std::size_t room) {
    near_.position = std::span(position_).first(room);
    near_.squared_m2 = std::span(squared_m2_).first(room * kernels::kBlock);
    near_.size = 0;
    near_.of.fill(0);
    return kernels::add_near_block(points(), block, kRanges, kSquared_m2, near_);
  }

  test::OwnedSurface surface_ = test::sphere(kPoints, 0.1, true);
  std::vector<float> rows_;
  std::array<std::vector<float>, 3> planes_;
  std::array<std::int32_t, kPoints> position_{};
  std::array<float, kPoints * kernels::kBlock> squared_m2_{};
  kernels::NearBlock near_;
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, BlockPairs, testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

TEST_P(BlockPairs, FindWhatEachPointAloneFinds) {
  for (const kernels::BlockOfPoints& block : kBlocks) {
    ASSERT_TRUE(find(block, kPoints));
    EXPECT_LT(near_.size, 200U) << "points out of reach were taken as well";
    for (std::int32_t lane = 0; lane < kernels::kBlock; ++lane) {
      Around found;
      for (std::size_t i = 0; i < near_.size; ++i) {
        const float squared = squared_m2_[i * kernels::kBlock + static_cast<std::size_t>(lane)];
        if (squared == kernels::kOutside) continue;
        found.position.push_back(position_[i]);
        found.squared_m2.push_back(squared);
      }
      const Around expected = lane < block.count ? around(block.first + lane) : Around{};
      EXPECT_EQ(found.position, expected.position);
      EXPECT_EQ(found.squared_m2, expected.squared_m2);
      EXPECT_EQ(static_cast<std::size_t>(near_.of[static_cast<std::size_t>(lane)]),
                expected.position.size());
    }
  }
}

TEST_P(BlockPairs, SayWhereThereIsNoRoom) {
  // As many as the longest range are asked room for.
  EXPECT_FALSE(find(kBlocks[0], 200));
  EXPECT_TRUE(find(kBlocks[0], kPoints));
}

kernels::PairBinCounts plain_counts(std::span<const std::int32_t> bins) {
  kernels::PairBinCounts counts{};
  for (const std::int32_t packed : bins) {
    if (packed == kernels::kNoPair) continue;
    for (std::size_t feature = 0; feature < 3; ++feature) {
      ++counts[11 * feature + (static_cast<std::size_t>(packed) >> (8 * feature) & 0xff)];
    }
  }
  return counts;
}

TEST_P(BlockPairs, CountBinsAsPlainLoopsDo) {
  Rng rng(16);
  // More than a byte counts, in one bin as well.
  for (const std::size_t count : {0U, 1U, 7U, 60U, 5000U}) {
    for (const std::uint32_t different : {1U, 11U}) {
      std::vector<std::int32_t> bins(count + 8, kernels::kNoPair);
      for (std::size_t i = 0; i < count; ++i) {
        if (rng.uniform() < 0.1) continue;
        bins[i] = static_cast<std::int32_t>(rng.below(different) | rng.below(different) << 8 |
                                            rng.below(different) << 16);
      }
      kernels::PairBinCounts counts{};
      kernels::count_bins(bins.data(), count, counts);
      EXPECT_EQ(counts, plain_counts(bins));
    }
  }
}

TEST_P(BlockPairs, CountThePairsOfEachPoint) {
  std::vector<std::int32_t> room(kPoints * kernels::kBlock);
  for (const kernels::BlockOfPoints& block : kBlocks) {
    ASSERT_TRUE(find(block, kPoints));
    std::array<kernels::PairBinCounts, kernels::kBlock> counts;
    kernels::count_block_pairs(rows_.data(), block, near_, room, counts);
    for (std::int32_t lane = 0; lane < kernels::kBlock; ++lane) {
      kernels::PairBinCounts expected{};
      if (lane < block.count) {
        const Around others = around(block.first + lane);
        std::vector<std::int32_t> bins(others.position.size());
        kernels::reference::pair_bins(rows_.data(), block.first + lane, others.position,
                                      bins.data());
        expected = plain_counts(bins);
        EXPECT_GT(bins.size(), 10U);
      }
      EXPECT_EQ(counts[static_cast<std::size_t>(lane)], expected) << block.first << " " << lane;
    }
  }
}

TEST_P(BlockPairs, AddRowsAsEachPointAloneDoes) {
  constexpr std::size_t kStride = 48;
  Rng rng(17);
  kernels::BlockRows rows{};
  std::vector<std::int32_t> row_at(kPoints, -1);
  std::int32_t count = 0;
  for (std::size_t i = 0; i < row_at.size(); i += 1 + i % 3) row_at[i] = count++;
  std::vector<float> matrix(static_cast<std::size_t>(count) * kStride, 0.0F);
  std::vector<float> expected = matrix;
  for (const kernels::BlockOfPoints& block : kBlocks) {
    ASSERT_TRUE(find(block, kPoints));
    for (auto& row : rows) {
      for (float& value : row) value = static_cast<float>(rng.uniform());
    }
    kernels::add_block_rows(rows, near_, row_at.data(), kStride, matrix.data());
    for (std::int32_t lane = 0; lane < block.count; ++lane) {
      const Around others = around(block.first + lane);
      std::vector<std::int32_t> targets(kPoints);
      std::vector<float> weights(kPoints);
      const std::size_t found = kernels::reference::select_rows(
          others.position, others.squared_m2.data(), row_at.data(), targets.data(), weights.data());
      kernels::reference::add_weighted_row(rows[static_cast<std::size_t>(lane)].data(),
                                           std::span(targets).first(found), weights.data(), kStride,
                                           expected.data());
    }
  }
  EXPECT_EQ(matrix, expected);
}

}  // namespace
}  // namespace grapnel
