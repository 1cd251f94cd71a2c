#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/reference.h"
#include "pipeline/kernels/target.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

/// Every test runs on each target that this machine has, and must give the same bits as the plain
/// loops of reference.h.
class FeatureKernel : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, FeatureKernel, testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

/// Scattered points with normals that lean; slack behind them, two of them coincident.
struct Points {
  std::array<std::vector<float>, 6> plane;
  explicit Points(std::size_t count) {
    Rng rng(17);
    for (auto& values : plane) values.assign(count + 16, 0.0F);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3d normal = Vec3d(0.4 * rng.normal(), 0.4 * rng.normal(), 1.0).normalized();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        plane[axis][i] = static_cast<float>(0.05 * rng.uniform(-1.0, 1.0));
        plane[3 + axis][i] = static_cast<float>(normal[static_cast<Eigen::Index>(axis)]);
      }
    }
    for (auto& values : plane) values[count - 1] = values[0];
  }
  [[nodiscard]] kernels::OrientedPlanes planes() const {
    return {plane[0].data(), plane[1].data(), plane[2].data(),
            plane[3].data(), plane[4].data(), plane[5].data()};
  }
};

TEST_P(FeatureKernel, CellsOfAllPairsAreCountedAsByPlainLoops) {
  for (const std::size_t count : {0U, 1U, 2U, 9U, 67U}) {
    for (const int bins : {2, 5}) {
      const Points points(67);
      const auto cells = static_cast<std::size_t>(bins * bins * bins);
      std::array<std::vector<std::uint32_t>, kernels::kPairCellTables> tables;
      std::vector<std::uint32_t> expected(cells + 1, 0);
      kernels::PairCellCounts counts;
      for (std::size_t i = 0; i < tables.size(); ++i) {
        tables[i].assign(cells + 1, 0);
        counts.table[i] = tables[i].data();
      }
      kernels::count_pair_cells(points.planes(), count, bins, counts);
      kernels::reference::count_pair_cells(points.planes(), count, bins, {{expected.data()}});
      for (std::size_t cell = 0; cell < cells; ++cell) {
        EXPECT_EQ(tables[0][cell] + tables[1][cell] + tables[2][cell] + tables[3][cell],
                  expected[cell]);
      }
    }
  }
}

TEST_P(FeatureKernel, SpinVotesHaveTheSameBitsAsPlainLoops) {
  const Points points(67);
  std::vector<std::int32_t> others;
  for (std::int32_t i = 0; i < 67; i += 1 + i % 3) others.push_back(i);
  struct Votes {
    std::vector<std::int32_t> cell = std::vector<std::int32_t>(80);
    std::array<std::vector<float>, 3> value;
    Votes() { value.fill(std::vector<float>(80)); }
    kernels::SpinVotes view() {
      return {cell.data(), value[0].data(), value[1].data(), value[2].data()};
    }
  };
  for (const bool radial : {false, true}) {
    for (const bool angular : {false, true}) {
      kernels::SpinFrame frame{points.plane[0][3],
                               points.plane[1][3],
                               points.plane[2][3],
                               points.plane[3][3],
                               points.plane[4][3],
                               points.plane[5][3],
                               0.7F,
                               0.009F,
                               8,
                               radial,
                               angular};
      Votes votes;
      Votes expected;
      kernels::spin_votes(points.planes(), frame, others, votes.view());
      kernels::reference::spin_votes(points.planes(), frame, others, expected.view());
      for (std::size_t i = 0; i < others.size(); ++i) {
        ASSERT_EQ(votes.cell[i], expected.cell[i]);
        for (std::size_t k = 0; k < (angular ? 3U : 2U); ++k) {
          ASSERT_EQ(std::memcmp(&votes.value[k][i], &expected.value[k][i], sizeof(float)), 0);
        }
      }
    }
  }
}

TEST_P(FeatureKernel, BestRowsAreThoseOfPlainLoops) {
  using kernels::BestRow;
  using kernels::RowScore;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Rng rng(23);
  for (const std::size_t blocks : {1U, 2U, 23U}) {
    for (const std::size_t length : {1U, 33U}) {
      // Small whole numbers make real ties, whose order must not matter.
      const auto numbers = [&](std::size_t count) {
        std::vector<float> list(count);
        for (float& value : list) value = static_cast<float>(rng.below(9));
        return list;
      };
      const std::vector<float> rows = numbers(blocks * 8 * length);
      std::vector<float> bias(blocks * 8, 0.0F);
      bias[blocks * 8 - 3] = kInfinity;
      const kernels::RowBlocks searched{rows.data(), bias.data(), blocks, length};
      for (std::size_t score = 0; score < 7; ++score) {
        for (const std::size_t count : {1U, 3U, 4U}) {
          const std::vector<float> queries = numbers(count * length);
          std::array<const float*, 4> group{};
          std::array<std::array<BestRow, 3>, 4> found;
          std::array<std::array<BestRow, 3>, 4> expected;
          std::array<BestRow*, 4> lists{};
          std::array<BestRow*, 4> expected_lists{};
          for (std::size_t q = 0; q < count; ++q) {
            group[q] = queries.data() + q * length;
            found[q].fill({kInfinity, -1});
            expected[q].fill({kInfinity, -1});
            lists[q] = found[q].data();
            expected_lists[q] = expected[q].data();
          }
          const auto kind = static_cast<RowScore>(score);
          kernels::best_rows(kind, searched, group.data(), count, 3, lists.data());
          kernels::reference::best_rows(kind, searched, group.data(), count, 3,
                                        expected_lists.data());
          for (std::size_t q = 0; q < count; ++q) {
            for (std::size_t k = 0; k < 3; ++k) {
              EXPECT_EQ(found[q][k].row, expected[q][k].row);
              EXPECT_EQ(found[q][k].score, expected[q][k].score);
            }
          }
        }
      }
    }
  }
}

TEST_P(FeatureKernel, WeightedRowsHaveTheSameBitsAsPlainLoops) {
  Rng rng(31);
  const auto numbers = [&](std::size_t count) {
    std::vector<float> list(count);
    for (float& value : list) value = static_cast<float>(rng.uniform(0.0, 100.0));
    return list;
  };
  const std::vector<float> row = numbers(kernels::kWeightedLength);
  const std::vector<float> weights = numbers(5);
  const std::vector<std::int32_t> targets = {3, 0, 3, 1, 4};
  std::vector<float> matrix = numbers(5 * 48);
  std::vector<float> expected = matrix;
  kernels::add_weighted_row(row.data(), targets, weights.data(), 48, matrix.data());
  kernels::reference::add_weighted_row(row.data(), targets, weights.data(), 48, expected.data());
  EXPECT_EQ(std::memcmp(matrix.data(), expected.data(), matrix.size() * sizeof(float)), 0);
}

TEST_P(FeatureKernel, SelectedRowsAreThoseOfPlainLoops) {
  Rng rng(32);
  std::vector<std::int32_t> row_at(300);
  for (std::int32_t& row : row_at) {
    row = rng.below(4) == 0 ? static_cast<std::int32_t>(rng.below(50)) : -1;
  }
  for (const std::size_t count : {0U, 1U, 8U, 13U, 250U}) {
    // Behind the neighbours positions that are none.
    std::vector<std::int32_t> position(count + kernels::kRowSlack, 1 << 30);
    std::vector<float> squared_m2(position.size(), 1.0F);
    for (std::size_t i = 0; i < count; ++i) {
      position[i] = static_cast<std::int32_t>(rng.below(300));
      squared_m2[i] = rng.below(5) == 0 ? 0.0F : static_cast<float>(rng.uniform(1e-6, 1.0));
    }
    const std::span<const std::int32_t> neighbours = std::span(position).first(count);
    std::vector<std::int32_t> rows(count + kernels::kRowSlack), plain_rows(rows.size());
    std::vector<float> weights(rows.size()), plain_weights(rows.size());
    const std::size_t found = kernels::select_rows(neighbours, squared_m2.data(), row_at.data(),
                                                   rows.data(), weights.data());
    ASSERT_EQ(found, kernels::reference::select_rows(neighbours, squared_m2.data(), row_at.data(),
                                                     plain_rows.data(), plain_weights.data()));
    EXPECT_EQ(std::memcmp(rows.data(), plain_rows.data(), found * sizeof(std::int32_t)), 0);
    EXPECT_EQ(std::memcmp(weights.data(), plain_weights.data(), found * sizeof(float)), 0);
  }
}

TEST_P(FeatureKernel, InliersAndAgreeingPairsAreThoseOfPlainLoops) {
  for (const std::size_t count : {1U, 8U, 67U, 500U}) {
    Points points(500);
    // Targets near the sources: about half of the pairs are inliers, and many agree.
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < 500; ++i) {
        points.plane[3 + axis][i] =
            points.plane[axis][i] + 0.02F * (points.plane[3 + axis][i] - 0.5F);
      }
    }
    const kernels::PairPlanes pairs{points.plane[0].data(), points.plane[1].data(),
                                    points.plane[2].data(), points.plane[3].data(),
                                    points.plane[4].data(), points.plane[5].data()};
    const kernels::RigidMotion motion{{0.8F, -0.6F, 0.0F, 0.6F, 0.8F, 0.0F, 0.0F, 0.0F, 1.0F},
                                      {0.001F, -0.002F, 0.003F}};
    const float squared = 0.03F * 0.03F;
    const std::size_t inliers = kernels::reference::count_inliers(pairs, count, motion, squared);
    EXPECT_EQ(kernels::count_inliers(pairs, count, motion, squared, 0), inliers);
    // Told to beat more than there are, it may give up but must not count more.
    EXPECT_LE(kernels::count_inliers(pairs, count, motion, squared, count), inliers);
    std::vector<std::uint64_t> bits((count + 63) / 64, ~std::uint64_t{0});
    std::vector<std::uint64_t> expected(bits.size());
    const kernels::PairAgreement agreement{0.01F, 0.02F};
    kernels::agreeing_pairs(pairs, count, count / 2, agreement, bits.data());
    kernels::reference::agreeing_pairs(pairs, count, count / 2, agreement, expected.data());
    EXPECT_EQ(bits, expected);
  }
}

}  // namespace
}  // namespace grapnel
