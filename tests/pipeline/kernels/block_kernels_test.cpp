#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/gaussian_sums.h"
#include "pipeline/kernels/reference.h"
#include "pipeline/kernels/target.h"

namespace grapnel {
namespace {

constexpr std::int32_t kPoints = 150;
constexpr std::size_t kRoom = static_cast<std::size_t>(kPoints) + kernels::kSlack;
constexpr int kBlock = kernels::kBlock;

/// Every test runs on each target that this machine has, against the plain loops: the same bits.
class BlockKernel : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, BlockKernel, testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

/// Points in a cube of a metre with normals, a tenth of them without.
struct Points {
  std::array<std::vector<float>, 7> plane;

  Points() {
    Rng rng(61);
    for (std::vector<float>& values : plane) values.assign(kRoom, 0.0F);
    for (std::size_t i = 0; i < static_cast<std::size_t>(kPoints); ++i) {
      for (std::size_t k = 0; k < 3; ++k) plane[k][i] = static_cast<float>(rng.uniform());
      if (rng.uniform() < 0.1) continue;
      for (std::size_t k = 3; k < 6; ++k) plane[k][i] = static_cast<float>(rng.normal());
      plane[6][i] = 1.0F;
    }
  }
  [[nodiscard]] kernels::PointPlanes points() const {
    return {plane[0].data(), plane[1].data(), plane[2].data()};
  }
  [[nodiscard]] kernels::NormalPlanes normals() const {
    return {plane[3].data(), plane[4].data(), plane[5].data(), plane[6].data()};
  }
};

struct Sums {
  float of[kernels::kWindowSums][kBlock] = {};
};

void expect_same(const Sums& found, const Sums& expected, const kernels::BlockOfPoints& block) {
  for (int k = 0; k < kernels::kWindowSums; ++k) {
    for (int lane = 0; lane < block.count; ++lane) {
      EXPECT_EQ(found.of[k][lane], expected.of[k][lane]) << block.first << " " << k << " " << lane;
    }
  }
}

constexpr std::array<PointRange, 3> kRanges = {PointRange{0, 41}, {50, 50}, {57, kPoints}};
constexpr std::array<kernels::BlockOfPoints, 4> kBlocks = {
    kernels::BlockOfPoints{0, 8}, {13, 5}, {100, 1}, {kPoints - 3, 3}};
constexpr float kSquared_m2 = 0.09F;

TEST_P(BlockKernel, ScatterIsThatOfPlainLoops) {
  const Points cloud;
  for (const bool first : {false, true}) {
    for (const kernels::BlockOfPoints& block : kBlocks) {
      Sums found;
      Sums expected;
      kernels::block_scatter(cloud.points(), block, kRanges, kSquared_m2, first, found.of);
      kernels::reference::block_scatter(cloud.points(), block, kRanges, kSquared_m2, first,
                                        expected.of);
      expect_same(found, expected, block);
      EXPECT_GT(found.of[0][0], 1.0F);
    }
  }
}

TEST_P(BlockKernel, SumsOfNormalsAreThoseOfPlainLoops) {
  const Points cloud;
  for (const bool about : {false, true}) {
    for (const kernels::BlockOfPoints& block : kBlocks) {
      Sums found;
      Sums expected;
      kernels::block_normals(cloud.points(), cloud.normals(), block, kRanges, kSquared_m2, about,
                             found.of);
      kernels::reference::block_normals(cloud.points(), cloud.normals(), block, kRanges,
                                        kSquared_m2, about, expected.of);
      expect_same(found, expected, block);
      EXPECT_GT(found.of[0][0], 1.0F);
    }
  }
}

std::vector<std::array<std::int32_t, 2>> listed(const kernels::Stretches& stretches) {
  std::vector<std::array<std::int32_t, 2>> list;
  for (const PointRange& range : stretches.list()) list.push_back({range.begin, range.end});
  return list;
}

TEST_P(BlockKernel, MembersOfNearBoxesAreThoseOfPlainLoops) {
  const Points cloud;
  std::array<std::vector<float>, 3> high;
  for (std::size_t k = 0; k < 3; ++k) {
    high[k] = cloud.plane[k];
    for (float& value : high[k]) value += 0.05F;
  }
  const kernels::BoxPlanes boxes{cloud.plane[0].data(), cloud.plane[1].data(),
                                 cloud.plane[2].data(), high[0].data(),
                                 high[1].data(),        high[2].data()};
  std::vector<float> begin(kRoom + 1);
  for (std::size_t i = 0; i < begin.size(); ++i) begin[i] = static_cast<float>(5 * i + i % 3);
  const kernels::Box box{{0.4F, 0.3F, 0.1F}, {0.6F, 0.8F, 0.9F}};
  const auto range = [](std::int32_t first, std::int32_t end) { return PointRange{first, end}; };
  for (const std::vector<PointRange>& ranges :
       {std::vector{range(0, kPoints)}, {range(3, 4), range(4, 21), range(90, kPoints)}, {}}) {
    for (const float squared_m2 : {0.0F, 0.01F, 4.0F}) {
      kernels::Stretches found;
      kernels::Stretches expected;
      kernels::near_members(boxes, begin.data(), ranges, box, squared_m2, found);
      kernels::reference::near_members(boxes, begin.data(), ranges, box, squared_m2, expected);
      EXPECT_EQ(listed(found), listed(expected));
      EXPECT_EQ(found.list().empty(), ranges.empty());
    }
  }
}

/// Scales from 5 cm, `per_octave` to twice as much.
kernels::GaussianScales scales_of(std::size_t per_octave) {
  kernels::GaussianScales scales;
  scales.per_octave = per_octave;
  for (std::size_t k = 0; k < scales.count(); ++k) {
    const double sigma = 0.05 * std::exp2(static_cast<double>(k) / static_cast<double>(per_octave));
    scales.reach_m2[k] = static_cast<float>(9.0 * sigma * sigma);
    scales.eighth_m2[k] = static_cast<float>(0.0625 / (sigma * sigma));
  }
  return scales;
}

/// Mean of the normals' x around a point in double.
double gaussian_mean(const Points& cloud, std::int32_t centre, float reach_m2) {
  double weighted = 0.0;
  double weights = 0.0;
  for (const PointRange& range : kRanges) {
    for (std::int32_t i = range.begin; i < range.end; ++i) {
      double squared = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        const float* const plane = cloud.plane[k].data();
        squared += std::pow(static_cast<double>(plane[i]) - static_cast<double>(plane[centre]), 2);
      }
      if (squared > static_cast<double>(reach_m2)) continue;
      const double weight = std::exp(-4.5 * squared / static_cast<double>(reach_m2));
      weighted += weight * static_cast<double>(cloud.plane[3][static_cast<std::size_t>(i)]);
      weights += weight;
    }
  }
  return weighted / weights;
}

TEST_P(BlockKernel, GaussianMeansAreThoseOfEveryScaleByExponentials) {
  const Points cloud;
  for (std::size_t per_octave = 1; per_octave <= kernels::kMaxPerOctave; ++per_octave) {
    const kernels::GaussianScales scales = scales_of(per_octave);
    for (const kernels::BlockOfPoints& block : kBlocks) {
      float means[kernels::kMaxScales][kBlock];
      kernels::gaussian_means(cloud.points(), cloud.normals().x, block, kRanges, scales, means);
      for (std::size_t k = 0; k < scales.count(); ++k) {
        for (int lane = 0; lane < block.count; ++lane) {
          const std::int32_t centre = block.first + lane;
          if (centre >= kRanges[0].end && centre < kRanges[2].begin) continue;
          // Weights right to 1e-6, values up to 3, and the rounding of a hundred sums.
          EXPECT_NEAR(static_cast<double>(means[k][lane]),
                      gaussian_mean(cloud, centre, scales.reach_m2[k]), 1e-5)
              << per_octave << " " << k << " " << lane;
        }
      }
    }
  }
}

TEST(GaussianMeans, AreTheSameBitsOnEveryTarget) {
  const Points cloud;
  const kernels::GaussianScales scales = scales_of(3);
  const auto means_on = [&](const std::string& target) {
    EXPECT_TRUE(kernels::force_target(target));
    std::array<std::array<float, kBlock>, kernels::kMaxScales> means{};
    float found[kernels::kMaxScales][kBlock];
    kernels::gaussian_means(cloud.points(), cloud.normals().x, kBlocks[0], kRanges, scales, found);
    EXPECT_TRUE(kernels::force_target(""));
    for (std::size_t k = 0; k < scales.count(); ++k) {
      for (std::size_t lane = 0; lane < kBlock; ++lane) means[k][lane] = found[k][lane];
    }
    return means;
  };
  const std::vector<std::string> targets = kernels::target_names();
  for (const std::string& target : targets) {
    EXPECT_EQ(means_on(target), means_on(targets.front())) << target;
  }
}

}  // namespace
}  // namespace grapnel
