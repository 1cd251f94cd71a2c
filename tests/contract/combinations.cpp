// Every detector × descriptor × metric × rejector × refiner of the registries, one after the other
// in fixed memory: none may touch the heap after it is made.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "pipeline/preprocess/normals.h"
#include "pipeline/refine/closest_in_cells.h"
#include "tests/contract/feature_contract.h"
#include "tests/support/heap_guard.h"

namespace grapnel {
namespace {

using test::MethodCase;

/// A wavy sheet on its grid, with normals and some texture.
test::OwnedSurface textured_grid() {
  test::OwnedSurface sheet = test::wavy_grid(48, 36, 3);
  PcaNormals normals({});
  const test::ArenaMemory memory(
      [&](Arena& arena) { normals.reserve(arena, test::small_limits()); });
  EXPECT_TRUE(normals.estimate(*sheet).ok());
  for (std::size_t i = 0; i < sheet->size; ++i) {
    sheet->intensity[i] = static_cast<float>(sheet->grid.pixel_of[i] % 7) / 7.0F;
  }
  return sheet;
}

/// Some points near the sheet, to be moved onto it.
test::OwnedSurface small_part() {
  test::OwnedSurface part = test::oriented_ball(80);
  Pose pose = Pose::Identity();
  pose.translation() = Vec3d(0.0, 0.0, 1.1);
  test::move(*part, pose);
  return part;
}

/// A stage made from its registry, with memory of its own.
template <class StageKind>
struct Made {
  std::unique_ptr<StageKind> stage;
  test::ArenaMemory memory;
  Made(std::span<const Method<StageKind>> methods, const MethodCase& chosen)
      : stage(test::make_stage(methods, chosen)),
        memory([this](Arena& arena) { stage->reserve(arena, test::contract_limits()); }) {}
};

class Combinations : public testing::TestWithParam<std::tuple<MethodCase, MethodCase>> {
 protected:
  /// Runs one step with the heap guard armed.
  template <class Step>
  void guarded(const std::string& what, const Step& step) {
    test::arm_heap_guard();
    step();
    test::disarm_heap_guard();
    EXPECT_EQ(test::heap_calls(), 0U) << what << "\n" << test::first_heap_call();
    test::clear_first_heap_call();
  }

  /// Every refiner, short: how often it repeats itself does not matter here.
  static std::vector<std::unique_ptr<Made<PoseRefiner>>> refiners() {
    std::vector<std::unique_ptr<Made<PoseRefiner>>> list;
    for (MethodCase kind : test::every_choice(pose_refiners(), "metric")) {
      if (test::has_key(pose_refiners(), kind, "max_iterations")) {
        kind.keys += "max_iterations = 1\n";
      }
      if (test::has_key(pose_refiners(), kind, "max_points")) kind.keys += "max_points = 32\n";
      list.push_back(std::make_unique<Made<PoseRefiner>>(pose_refiners(), kind));
    }
    return list;
  }

  test::OwnedSurface part_ = small_part();
  test::OwnedSurface surface_ = textured_grid();
  std::vector<Keypoint> keypoint_storage_ = std::vector<Keypoint>(200);
  KeypointSet keypoints_{keypoint_storage_};
  std::vector<Correspondence> found_storage_ = std::vector<Correspondence>(400);
  Correspondences found_{found_storage_};
  std::vector<Correspondence> kept_storage_ = std::vector<Correspondence>(400);
};

std::string pair_name(const testing::TestParamInfo<std::tuple<MethodCase, MethodCase>>& given) {
  return test::case_name(std::get<0>(given.param)) + "_" +
         test::case_name(std::get<1>(given.param));
}

INSTANTIATE_TEST_SUITE_P(
    Registry, Combinations,
    testing::Combine(testing::ValuesIn(test::every_choice(keypoint_detectors(), "engine")),
                     testing::ValuesIn(test::every_choice(descriptor_estimators(), "engine"))),
    pair_name);

TEST_P(Combinations, DoNotTouchTheHeap) {
  if (!test::heap_guard_works()) GTEST_SKIP() << test::kNoHeapGuard;
  Made<KeypointDetector> detector(keypoint_detectors(), std::get<0>(GetParam()));
  Made<DescriptorEstimator> descriptor(descriptor_estimators(), std::get<1>(GetParam()));
  FeatureMatrix features;
  const test::ArenaMemory memory(
      [&](Arena& arena) { features.reserve(arena, 200, descriptor.stage->dimension()); });
  guarded("detect", [&] { static_cast<void>(detector.stage->detect(*surface_, keypoints_)); });
  guarded("describe", [&] {
    static_cast<void>(descriptor.stage->describe(*surface_, keypoints_.span(), features));
  });
  ClosestInCells closest;
  const test::ArenaMemory closest_memory([&](Arena& arena) { closest.reserve(arena, 2000); });
  guarded("index", [&] { static_cast<void>(closest.build(*surface_, surface_->spacing_m)); });
  const std::vector<std::unique_ptr<Made<PoseRefiner>>> refine = refiners();
  EXPECT_GE(refine.size(), 3U);
  const PairView view{&*surface_, &*surface_, keypoints_.span(), keypoints_.span()};
  for (const MethodCase& metric : test::every_choice(feature_matchers(), "metric")) {
    Made<FeatureMatcher> matcher(feature_matchers(), metric);
    guarded(metric.keys,
            [&] { static_cast<void>(matcher.stage->match(features, features, found_)); });
    for (const MethodCase& kind : test::every_choice(correspondence_rejectors(), "keep")) {
      Made<CorrespondenceRejector> rejector(correspondence_rejectors(), kind);
      Correspondences kept{kept_storage_};
      for (const Correspondence& pair : found_) kept.push_back(pair);
      Rng rng(1);
      guarded(metric.keys + kind.name,
              [&] { static_cast<void>(rejector.stage->reject(view, kept, rng)); });
      guarded("refine", [&] {
        for (const std::unique_ptr<Made<PoseRefiner>>& refiner : refine) {
          static_cast<void>(
              refiner->stage->refine(*part_, *surface_, closest, Pose::Identity()).ok());
        }
      });
    }
  }
}

}  // namespace
}  // namespace grapnel
