// What every rejector of the registry must do.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <limits>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/target.h"
#include "tests/contract/feature_contract.h"
#include "tests/support/heap_guard.h"

namespace grapnel {
namespace {

using test::MethodCase;

constexpr std::size_t kPairs = 180;

/// A ball and a copy of it; a third of the pairs is right, and nearer than the others.
struct Scene {
  test::OwnedSurface source = test::oriented_ball(kPairs);
  test::OwnedSurface target = test::oriented_ball(kPairs);
  std::vector<Keypoint> keypoints = test::keypoints_of(*source, 1);
  std::vector<Correspondence> given;
  Scene() {
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(kPairs); ++i) {
      const bool right = i % 3 == 0;
      const std::int32_t other = (i * 7 + 13) % static_cast<std::int32_t>(kPairs);
      given.push_back({i, right ? i : other, right ? 0.1F : 0.5F + 0.001F * static_cast<float>(i)});
    }
  }
  [[nodiscard]] PairView view() { return {&*source, &*target, keypoints, keypoints}; }
};

class RejectorContract : public testing::TestWithParam<MethodCase> {
 protected:
  RejectorContract()
      : rejector_(test::make_stage(correspondence_rejectors(), GetParam())),
        memory_([this](Arena& arena) { rejector_->reserve(arena, test::contract_limits()); }) {}

  Status reject(const PairView& view, const std::vector<Correspondence>& given) {
    pairs_.clear();
    for (const Correspondence& pair : given) pairs_.push_back(pair);
    Rng rng(1);
    return rejector_->reject(view, pairs_, rng);
  }
  /// True when what is left stands in `given` in this order.
  [[nodiscard]] bool is_part_of(const std::vector<Correspondence>& given) const {
    std::size_t at = 0;
    for (const Correspondence& pair : pairs_) {
      while (at < given.size() &&
             (given[at].source != pair.source || given[at].target != pair.target)) {
        ++at;
      }
      if (at++ == given.size()) return false;
    }
    return true;
  }
  [[nodiscard]] std::vector<std::int32_t> sources() const {
    std::vector<std::int32_t> list;
    for (const Correspondence& pair : pairs_) list.push_back(pair.source);
    return list;
  }

  /// Both ascending. A pair at the threshold may fall to either side by rounding, and of random
  /// draws the best may be another.
  static void expect_mostly(const std::vector<std::int32_t>& these,
                            const std::vector<std::int32_t>& those) {
    std::vector<std::int32_t> common;
    std::set_intersection(these.begin(), these.end(), those.begin(), those.end(),
                          std::back_inserter(common));
    EXPECT_GE(20 * common.size(), 19 * std::max(these.size(), those.size()));
  }

  std::unique_ptr<CorrespondenceRejector> rejector_;
  test::ArenaMemory memory_;
  std::vector<Correspondence> storage_ = std::vector<Correspondence>(1000);
  Correspondences pairs_{storage_};
};

INSTANTIATE_TEST_SUITE_P(Registry, RejectorContract,
                         testing::ValuesIn(test::every_choice(correspondence_rejectors(), "keep")),
                         [](const auto& given) { return test::case_name(given.param); });

TEST_P(RejectorContract, ShortensTheListAndKeepsItsOrder) {
  Scene scene;
  ASSERT_TRUE(reject(scene.view(), scene.given).ok());
  EXPECT_TRUE(is_part_of(scene.given));
}

TEST_P(RejectorContract, KeepsMostRightPairsAndNoLargerShareOfWrongOnes) {
  Scene scene;
  ASSERT_TRUE(reject(scene.view(), scene.given).ok());
  std::size_t right = 0;
  for (const Correspondence& pair : pairs_) right += pair.source == pair.target ? 1U : 0U;
  EXPECT_GE(right, 54U);
  EXPECT_GE(3 * right, pairs_.size());
}

TEST_P(RejectorContract, GivesTheSamePairsAgainAndOnEveryTarget) {
  Scene scene;
  ASSERT_TRUE(reject(scene.view(), scene.given).ok());
  const std::vector<std::int32_t> first = sources();
  for (const std::string& target : kernels::target_names()) {
    ASSERT_TRUE(kernels::force_target(target));
    const bool ok = reject(scene.view(), scene.given).ok();
    ASSERT_TRUE(kernels::force_target(""));
    ASSERT_TRUE(ok);
    EXPECT_EQ(sources(), first) << target;
  }
}

TEST_P(RejectorContract, FollowsMotionsOfTheSurfacesAndAScale) {
  Scene scene;
  ASSERT_TRUE(reject(scene.view(), scene.given).ok());
  const std::vector<std::int32_t> still = sources();
  for (const double scale : {1.0, 2.0}) {
    Scene changed;
    Pose of_source = Pose::Identity();
    Pose of_target = Pose::Identity();
    // The normals' own rejector compares directions in one frame.
    if (scale == 1.0 && GetParam().name != "surface_normal") {
      of_source.linear() = rotation_from_vector(Vec3d(0.4, -0.9, 1.2));
      of_target.linear() = rotation_from_vector(Vec3d(-1.0, 0.3, 0.7));
      of_source.translation() = Vec3d(0.3, 0.2, -0.5);
      of_target.translation() = Vec3d(-0.1, 0.6, 0.2);
    }
    test::move(*changed.source, of_source);
    test::move(*changed.target, of_target);
    for (Surface* surface : {&*changed.source, &*changed.target}) {
      for (std::size_t i = 0; i < surface->size; ++i) {
        surface->x[i] *= static_cast<float>(scale);
        surface->y[i] *= static_cast<float>(scale);
        surface->z[i] *= static_cast<float>(scale);
      }
      surface->spacing_m *= scale;
    }
    ASSERT_TRUE(reject(changed.view(), changed.given).ok());
    expect_mostly(still, sources());
  }
}

TEST_P(RejectorContract, DoesNotDependOnTheOrderOfThePairs) {
  Scene scene;
  ASSERT_TRUE(reject(scene.view(), scene.given).ok());
  std::vector<std::int32_t> straight = sources();
  std::reverse(scene.given.begin(), scene.given.end());
  ASSERT_TRUE(reject(scene.view(), scene.given).ok());
  std::vector<std::int32_t> reversed = sources();
  std::sort(straight.begin(), straight.end());
  std::sort(reversed.begin(), reversed.end());
  expect_mostly(straight, reversed);
}

TEST_P(RejectorContract, GivesAnErrorOrAPartOnOddPairsInBoundedTime) {
  Scene scene;
  const Correspondence one = scene.given.front();
  std::vector<Correspondence> odd_distances = scene.given;
  odd_distances[5].distance = std::numeric_limits<float>::quiet_NaN();
  odd_distances[6].distance = std::numeric_limits<float>::infinity();
  const std::vector<std::vector<Correspondence>> lists = {
      {}, {one}, {one, scene.given[3]}, std::vector<Correspondence>(100, one), odd_distances};
  for (const std::vector<Correspondence>& given : lists) {
    const auto start = std::chrono::steady_clock::now();
    const Status status = reject(scene.view(), given);
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(2));
    if (!status.ok()) {
      EXPECT_EQ(status.error().stage, Stage::Reject);
    } else {
      EXPECT_TRUE(is_part_of(given));
    }
  }
}

TEST_P(RejectorContract, GivesAnErrorOrAPartOnOddSurfacesInBoundedTime) {
  for (test::OddSurface& odd : test::odd_surfaces()) {
    const std::vector<Keypoint> keypoints = test::keypoints_of(*odd.surface, 1);
    std::vector<Correspondence> given;
    for (const Keypoint& keypoint : keypoints) {
      given.push_back({keypoint.point, keypoint.point, 0.5F});
    }
    const auto start = std::chrono::steady_clock::now();
    const Status status = reject({&*odd.surface, &*odd.surface, keypoints, keypoints}, given);
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(2)) << odd.name;
    if (!status.ok()) {
      EXPECT_EQ(status.error().stage, Stage::Reject) << odd.name;
    } else {
      EXPECT_TRUE(is_part_of(given)) << odd.name;
    }
  }
}

TEST_P(RejectorContract, GivesAnErrorOrAPartWhenThereAreMorePairsThanReserved) {
  Scene scene;
  std::vector<Correspondence> many;
  while (many.size() < 900) many.insert(many.end(), scene.given.begin(), scene.given.end());
  const Status status = reject(scene.view(), many);
  if (!status.ok()) {
    EXPECT_EQ(status.error().code, Code::CapacityExceeded);
  } else {
    EXPECT_TRUE(is_part_of(many));
  }
}

TEST_P(RejectorContract, DoesNotTouchTheHeap) {
  if (!test::heap_guard_works()) GTEST_SKIP() << test::kNoHeapGuard;
  Scene scene;
  const PairView view = scene.view();
  for (const Correspondence& pair : scene.given) pairs_.push_back(pair);
  Rng rng(1);
  test::arm_heap_guard();
  const bool ok = rejector_->reject(view, pairs_, rng).ok();
  test::disarm_heap_guard();
  EXPECT_TRUE(ok);
  EXPECT_EQ(test::heap_calls(), 0U) << test::first_heap_call();
}

}  // namespace
}  // namespace grapnel
