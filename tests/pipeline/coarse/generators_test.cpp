#include "pipeline/coarse/generators.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "base/config.h"
#include "pipeline/coarse/generator_chain.h"
#include "pipeline/coarse/pose_score.h"
#include "pipeline/coarse/surface_ransac.h"
#include "pipeline/registry.h"
#include "tests/pipeline/support/surfaces.h"
#include "tests/support/heap_guard.h"

namespace grapnel {
namespace {

/// 200 keypoints on a bumpy ball and the same ball moved; every third pair is right, or all.
struct Pairs {
  test::OwnedSurface source = test::bumpy_ball(800, 0.2);
  test::OwnedSurface target = test::bumpy_ball(800, 0.2);
  std::vector<Keypoint> keypoints;
  std::vector<Correspondence> storage;
  Correspondences correspondences;
  Pose truth = Pose::Identity();
  ClosestPointTable source_table, target_table;
  SampleSet source_samples, target_samples;
  std::unique_ptr<test::ArenaMemory> memory;
  PoseScore score;

  explicit Pairs(int one_right_of) {
    truth.linear() = rotation_from_vector(Vec3d(0.4, 1.1, -0.7));
    truth.translation() = Vec3d(0.5, -0.2, 1.0);
    test::move(*target, truth);
    Rng rng(31);
    for (std::int32_t i = 0; i < 200; ++i) keypoints.push_back({4 * i, 1.0F, 0.01F});
    storage.resize(200);
    correspondences = Correspondences(storage);
    for (std::int32_t i = 0; i < 200; ++i) {
      const bool right = i % one_right_of == 0;
      correspondences.push_back({i, right ? i : static_cast<std::int32_t>(rng.below(200)), 0.0F});
    }
  }
  /// With a score of the surfaces as they are now.
  [[nodiscard]] PairView view() {
    memory = std::make_unique<test::ArenaMemory>([&](Arena& arena) {
      for (ClosestPointTable* table : {&source_table, &target_table}) table->reserve(arena, 60000);
      for (SampleSet* samples : {&source_samples, &target_samples}) samples->reserve(arena, 256);
    });
    source_table.build(*source, 0.02);
    target_table.build(*target, 0.02);
    source_samples.draw(*source, Rng(1));
    target_samples.draw(*target, Rng(2));
    score = PoseScore({&source_samples, &source_table, &*source},
                      {nullptr, &target_table, &*target, &target_samples}, 0.01F);
    return {&*source, &*target, keypoints, keypoints, &score};
  }
};

std::unique_ptr<HypothesisGenerator> with_defaults(std::size_t i) {
  const ConfigTable empty("", "coarse", 0);
  ConfigReader reader(empty);
  return hypothesis_generators()[i].make(reader);
}

class EveryGenerator : public testing::TestWithParam<std::size_t> {
 protected:
  EveryGenerator()
      : generator_(with_defaults(GetParam())), memory_([&](Arena& arena) {
          generator_->reserve(arena, test::small_limits());
          storage_ = arena.take<Hypothesis>(8);
        }) {
    hypotheses_ = Hypotheses(storage_);
  }
  std::unique_ptr<HypothesisGenerator> generator_;
  std::span<Hypothesis> storage_;
  test::ArenaMemory memory_;
  Hypotheses hypotheses_;
};

constexpr const char* kShapesAlone = "looks at the surfaces' shapes, not at pairs";

TEST_P(EveryGenerator, FindsTheMotionOfRightPairs) {
  if (!generator_->needs_correspondences()) GTEST_SKIP() << kShapesAlone;
  Pairs pairs(1);
  Rng rng(32);
  ASSERT_TRUE(generator_->generate(pairs.view(), pairs.correspondences, rng, hypotheses_).ok());
  ASSERT_FALSE(hypotheses_.empty());
  EXPECT_LT((hypotheses_[0].target_from_source.translation() - pairs.truth.translation()).norm(),
            1e-3);
  EXPECT_LT(rotation_angle_rad(hypotheses_[0].target_from_source, pairs.truth), 1e-3);
}

TEST_P(EveryGenerator, OrdersBySupport) {
  Pairs pairs(3);
  Rng rng(33);
  const Status status = generator_->generate(pairs.view(), pairs.correspondences, rng, hypotheses_);
  // Nothing on a bumpy ball is flat or round.
  ASSERT_TRUE(status.ok() || !generator_->needs_correspondences());
  for (std::size_t i = 1; i < hypotheses_.size(); ++i) {
    EXPECT_GE(hypotheses_[i - 1].support, hypotheses_[i].support);
  }
}

/// Random numbers that a search for the motion of pairs took, and whether it found it.
std::size_t numbers_drawn(double confidence, int one_right_of, bool& found) {
  SurfaceRansacParams params;
  params.draws = 20000;
  params.ratings = 1000000;
  params.confidence = confidence;
  SurfaceRansac generator(params);
  std::vector<Hypothesis> storage(8);
  Hypotheses hypotheses(storage);
  Pairs pairs(one_right_of);
  const test::ArenaMemory memory([&](Arena& arena) { generator.reserve(arena, Limits{}); });
  pairs.source->spacing_m = pairs.target->spacing_m = 0.01;
  Rng rng(36);
  EXPECT_TRUE(generator.generate(pairs.view(), pairs.correspondences, rng, hypotheses).ok());
  found = !hypotheses.empty() &&
          rotation_angle_rad(hypotheses[0].target_from_source, pairs.truth) < 1e-3;
  const std::uint64_t next = rng.next_u64();
  Rng again(36);
  for (std::size_t count = 0; count <= 60000; ++count) {
    if (again.next_u64() == next) return count;
  }
  return 0;
}

TEST(SurfaceRansac, StopsWhenARivalOfTheBestWouldHaveBeenDrawn) {
  bool found = false;
  // With all pairs right a half as large share needs ln 0.001 / ln (1 - 0.5³) = 52 draws.
  const std::size_t of_all = numbers_drawn(0.999, 1, found);
  EXPECT_TRUE(found);
  EXPECT_GT(of_all, 51U);
  EXPECT_LE(of_all, 3U * 52U);
  // A sixth needs 1489.
  const std::size_t of_third = numbers_drawn(0.999, 3, found);
  EXPECT_TRUE(found);
  EXPECT_GT(of_third, 1000U);
  EXPECT_LE(of_third, 3U * 1490U);
  EXPECT_GE(numbers_drawn(1.0, 3, found), 20000U);
}

TEST(SurfaceRansac, AsksForNoPairsWhereNoneAreDrawn) {
  SurfaceRansacParams params;
  EXPECT_TRUE(SurfaceRansac(params).needs_correspondences());
  params.draws = 0;
  EXPECT_FALSE(SurfaceRansac(params).needs_correspondences());
}

TEST_P(EveryGenerator, SaysThatTwoPairsAreTooFew) {
  if (!generator_->needs_correspondences()) GTEST_SKIP() << kShapesAlone;
  Pairs pairs(1);
  pairs.correspondences.resize(2);
  Rng rng(34);
  const Status status = generator_->generate(pairs.view(), pairs.correspondences, rng, hypotheses_);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, Code::TooFewCorrespondences);
  EXPECT_EQ(status.error().stage, Stage::Coarse);
}

TEST_P(EveryGenerator, EndsDegenerateCloudsInAnErrorOrAFinitePose) {
  for (int shape = 0; shape < 3; ++shape) {
    Pairs pairs(1);
    for (Surface* surface : {&*pairs.source, &*pairs.target}) {
      for (std::size_t i = 0; i < surface->size; ++i) {
        if (shape == 0) surface->x[i] = surface->y[i] = surface->z[i] = 1.0F;
        if (shape == 1) surface->x[i] = surface->y[i] = surface->z[i];
        if (shape == 2) surface->z[i] = 1.0F;
      }
    }
    Rng rng(35);
    hypotheses_.clear();
    const Status status =
        generator_->generate(pairs.view(), pairs.correspondences, rng, hypotheses_);
    if (!status.ok()) {
      EXPECT_EQ(status.error().stage, Stage::Coarse);
      continue;
    }
    for (const Hypothesis& hypothesis : hypotheses_) {
      EXPECT_TRUE(hypothesis.target_from_source.matrix().allFinite()) << shape;
    }
  }
}

TEST_P(EveryGenerator, TakesNothingFromTheHeap) {
  if (!test::heap_guard_works()) GTEST_SKIP() << test::kNoHeapGuard;
  Pairs pairs(3);
  Rng rng(36);
  const PairView view = pairs.view();
  test::arm_heap_guard();
  (void)generator_->generate(view, pairs.correspondences, rng, hypotheses_);
  test::disarm_heap_guard();
  EXPECT_EQ(test::heap_calls(), 0U);
}

INSTANTIATE_TEST_SUITE_P(OfTheRegistry, EveryGenerator,
                         testing::Range<std::size_t>(0, hypothesis_generators().size()),
                         [](const auto& generator) {
                           return std::string(hypothesis_generators()[generator.param].name);
                         });

TEST(RansacGenerator, FindsTheMotionAmongWrongPairs) {
  Pairs pairs(4);
  std::vector<Hypothesis> storage(8);
  Hypotheses hypotheses{std::span<Hypothesis>(storage)};
  Rng rng(37);
  RansacGeneratorParams params;
  params.inlier_m = 0.004;
  RansacGenerator generator(params);
  ASSERT_TRUE(generator.generate(pairs.view(), pairs.correspondences, rng, hypotheses).ok());
  EXPECT_GE(hypotheses[0].support, 50.0);
  EXPECT_LT(rotation_angle_rad(hypotheses[0].target_from_source, pairs.truth), 1e-2);
  // What is kept beside it is another pose.
  for (std::size_t i = 1; i < hypotheses.size(); ++i) {
    EXPECT_GT(
        rotation_angle_rad(hypotheses[i].target_from_source, pairs.truth) +
            (hypotheses[i].target_from_source.translation() - pairs.truth.translation()).norm(),
        0.01);
  }
}

TEST(GeneratorChain, SupportsTheHypothesesOfAllGeneratorsByTheViewsScore) {
  Pairs pairs(2);
  std::vector<std::unique_ptr<HypothesisGenerator>> list;
  for (std::size_t i = 0; i < hypothesis_generators().size(); ++i) list.push_back(with_defaults(i));
  GeneratorChain chain(std::move(list), 8);
  std::span<Hypothesis> storage;
  const test::ArenaMemory memory([&](Arena& arena) {
    chain.reserve(arena, test::small_limits());
    storage = arena.take<Hypothesis>(20);
  });
  Hypotheses hypotheses(storage);
  const PairView view = pairs.view();
  Rng rng(39);
  ASSERT_TRUE(chain.generate(view, pairs.correspondences, rng, hypotheses).ok());
  ASSERT_GE(hypotheses.size(), 2U);
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    EXPECT_EQ(hypotheses[i].support, pairs.score(hypotheses[i].target_from_source, SIZE_MAX));
    if (i > 0) {
      EXPECT_GE(hypotheses[i - 1].support, hypotheses[i].support);
    }
  }
  EXPECT_LT(rotation_angle_rad(hypotheses[0].target_from_source, pairs.truth), 0.02);
}

TEST(GeneratorChain, NeedsAScore) {
  Pairs pairs(1);
  PairView view = pairs.view();
  view.score = nullptr;
  std::vector<std::unique_ptr<HypothesisGenerator>> list;
  list.push_back(with_defaults(0));
  GeneratorChain chain(std::move(list), 8);
  Hypotheses none;
  Rng rng(40);
  const Status status = chain.generate(view, pairs.correspondences, rng, none);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, Code::BadParameter);
}

TEST(SampleConsensus, FindsTheMotionAmongWrongPairs) {
  Pairs pairs(3);
  std::vector<Hypothesis> storage(8);
  Hypotheses hypotheses{std::span<Hypothesis>(storage)};
  Rng rng(38);
  SampleConsensusParams params;
  params.draws = 3000;
  params.max_distance_ratio = 4.0;
  SampleConsensus generator(params);
  const test::ArenaMemory memory(
      [&](Arena& arena) { generator.reserve(arena, test::small_limits()); });
  ASSERT_TRUE(generator.generate(pairs.view(), pairs.correspondences, rng, hypotheses).ok());
  EXPECT_LT(rotation_angle_rad(hypotheses[0].target_from_source, pairs.truth), 0.02);
}

}  // namespace
}  // namespace grapnel
