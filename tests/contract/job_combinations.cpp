// Whole jobs by every combination of the registries: detector × descriptor × metric × rejector ×
// refiner, each with one of the generators, then every generator with every refiner. No
// combination may touch the heap after create, fail otherwise than by a named reason, or accept a
// wrong pose.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "base/math.h"
#include "pipeline/registrar.h"
#include "tests/contract/feature_contract.h"
#include "tests/contract/hills.h"
#include "tests/pipeline/support/box_scene.h"
#include "tests/support/heap_guard.h"

namespace grapnel {
namespace {

using test::MethodCase;
using test::sheet;
using test::truth_of_pair;

// Nothing on the sheet is as large as these, so a pose within them is no other pose.
constexpr double kWrong_m = 0.02;
constexpr double kWrong_rad = 0.1;

std::string table_of(const char* table, const MethodCase& method) {
  return std::string("[") + table + "]\nmethod = \"" + method.name + "\"\n" + method.keys;
}

struct Chosen {
  MethodCase detector{"uniform", ""};
  MethodCase descriptor{"fpfh", ""};
  MethodCase matcher{"nearest_feature", ""};
  MethodCase rejector{"median", ""};
  MethodCase generator{"surface_ransac", ""};
  MethodCase refiner{"icp", ""};

  [[nodiscard]] std::string text() const {
    std::string few = generator.keys;
    if (test::has_key(hypothesis_generators(), generator, "draws")) few += "draws = 400\n";
    return table_of("keypoints", detector) + table_of("descriptors", descriptor) +
           table_of("match", matcher) + table_of("reject", rejector) +
           table_of("coarse", {generator.name, few}) + table_of("refine_coarse", refiner) +
           table_of("refine", refiner);
  }
};

Preset small_preset(const std::string& text) {
  Preset preset;
  preset.name = "combination";
  preset.source =
      parse_config(text +
                       "[model]\nsurface_points = 1500\ntable_voxels = 40000\nsamples = 96\n"
                       "[views]\nviews = 20\nturns = 12\nfinalists = 20\n"
                       "[search]\nkept = 6\nfinalists = 3\nwinners = 1\n",
                   "combination.toml");
  preset.limits.max_width = 160;
  preset.limits.max_height = 120;
  preset.limits.max_points = 1500;
  preset.limits.max_input_points = 1500;
  preset.limits.max_model_points = 2000;
  preset.limits.max_keypoints = 100;
  preset.limits.max_correspondences = 300;
  return preset;
}

class JobCombinations : public testing::Test {
 protected:
  /// Runs the pair's job with the heap guard armed; whether its pose was accepted.
  bool accepted(const Chosen& chosen) {
    const auto registrar = Registrar::create(small_preset(chosen.text()));
    test::arm_heap_guard();
    const Result<RegistrationReports> result = registrar->register_pair(*source_, *target_, {});
    test::disarm_heap_guard();
    EXPECT_EQ(test::heap_calls(), 0U) << chosen.text() << test::first_heap_call();
    test::clear_first_heap_call();
    EXPECT_TRUE(result.ok()) << chosen.text();
    if (!result.ok()) return false;
    const RegistrationReport& report = result.value().objects[0];
    EXPECT_TRUE(report.accepted || report.reasons.size() > 0U) << chosen.text();
    if (report.accepted) expect_near_truth(report, chosen);
    return report.accepted;
  }
  void expect_near_truth(const RegistrationReport& report, const Chosen& chosen) const {
    const Pose& pose = report.target_from_source;
    EXPECT_LT((pose.translation() - truth_.translation()).norm(), kWrong_m) << chosen.text();
    EXPECT_LT(rotation_angle_rad(pose, truth_), kWrong_rad) << chosen.text();
  }

  Pose truth_ = truth_of_pair();
  test::OwnedSurface source_ = sheet(30, 0.0, Pose::Identity());
  test::OwnedSurface target_ = sheet(32, 0.3, truth_);
};

using Features = std::tuple<MethodCase, MethodCase>;
class PairJobs : public JobCombinations, public testing::WithParamInterface<Features> {};

std::string features_name(const testing::TestParamInfo<Features>& given) {
  return std::get<0>(given.param).name + "_" + std::get<1>(given.param).name;
}

INSTANTIATE_TEST_SUITE_P(
    Registry, PairJobs,
    testing::Combine(testing::ValuesIn(test::every_choice(keypoint_detectors(), "")),
                     testing::ValuesIn(test::every_choice(descriptor_estimators(), ""))),
    features_name);

TEST_P(PairJobs, WithEveryMetricRejectorAndRefinerNeitherTouchTheHeapNorAcceptAWrongPose) {
  Chosen chosen;
  chosen.detector = std::get<0>(GetParam());
  chosen.descriptor = std::get<1>(GetParam());
  const std::vector<MethodCase> generators = test::every_choice(hypothesis_generators(), "");
  // A sanitizer is ten times as slow and counts no heap calls: every seventh, which meets them all.
  const std::size_t stride = test::heap_guard_works() ? 1 : 7;
  std::size_t count = 0;
  int right = 0;
  for (const MethodCase& metric : test::every_choice(feature_matchers(), "metric")) {
    for (const MethodCase& rejector : test::every_choice(correspondence_rejectors(), "")) {
      for (const MethodCase& refiner : test::every_choice(pose_refiners(), "metric")) {
        if (count++ % stride != 0) continue;
        chosen.matcher = metric;
        chosen.rejector = rejector;
        chosen.refiner = refiner;
        chosen.generator = generators[count / stride % generators.size()];
        right += accepted(chosen) ? 1 : 0;
      }
    }
  }
  RecordProperty("combinations", static_cast<int>(count));
  EXPECT_GT(right, 0) << "a test in which nothing is accepted says nothing of wrong poses";
}

TEST_F(JobCombinations, EveryGeneratorRunsWithEveryRefinerAndEngine) {
  int right = 0;
  for (const MethodCase& generator : test::every_choice(hypothesis_generators(), "")) {
    for (const MethodCase& refiner : test::every_choice(pose_refiners(), "metric")) {
      for (const MethodCase& descriptor : test::every_choice(descriptor_estimators(), "engine")) {
        Chosen chosen;
        chosen.generator = generator;
        chosen.refiner = refiner;
        chosen.descriptor = descriptor;
        right += accepted(chosen) ? 1 : 0;
      }
    }
  }
  EXPECT_GT(right, 0);
}

TEST_F(JobCombinations, SeveralRejectorsAndGeneratorsInOnePreset) {
  std::string text = table_of("keypoints", {"uniform", ""});
  for (const auto& method : correspondence_rejectors()) {
    if (method.name != "median" && method.name != "one_to_one") continue;
    text += "[[reject]]\nmethod = \"" + std::string(method.name) + "\"\n";
  }
  for (const auto& method : hypothesis_generators()) {
    text += "[[coarse]]\nmethod = \"" + std::string(method.name) + "\"\n";
  }
  const auto registrar = Registrar::create(small_preset(text));
  test::arm_heap_guard();
  const Result<RegistrationReports> result = registrar->register_pair(*source_, *target_, {});
  test::disarm_heap_guard();
  EXPECT_EQ(test::heap_calls(), 0U) << test::first_heap_call();
  ASSERT_TRUE(result.ok());
  EXPECT_TRUE(result.value().objects[0].accepted);
}

/// A box on a belt, found by one stage's method after the other, the others as usual.
class ObjectJobs : public testing::Test {
 protected:
  void run(const Chosen& chosen) {
    Preset preset = small_preset(chosen.text());
    preset.models = {test::box_model(size_m_, 0.012)};
    const auto registrar = Registrar::create(std::move(preset));
    test::arm_heap_guard();
    const Result<RegistrationReports> result = registrar->run(scene_.frame(), {});
    test::disarm_heap_guard();
    EXPECT_EQ(test::heap_calls(), 0U) << chosen.text() << test::first_heap_call();
    test::clear_first_heap_call();
    ASSERT_TRUE(result.ok()) << chosen.text();
    ASSERT_EQ(result.value().objects.size(), 1U);
    const RegistrationReport& report = result.value().objects[0];
    const Pose found = nearest_equivalent(report.target_from_source, truth_, Symmetry::Box);
    const bool right = report.has_pose &&
                       (found.translation() - truth_.translation()).norm() < kWrong_m &&
                       rotation_angle_rad(found, truth_) < kWrong_rad;
    EXPECT_TRUE(right || !report.accepted) << chosen.text();
    right_ += right ? 1 : 0;
  }

  Vec3d size_m_{0.4, 0.3, 0.2};
  Pose truth_ = test::lying(size_m_, 1.1, 0.02, -0.03, 0.6);
  test::BoxScene scene_ = [this] {
    test::BoxScene scene(160, 120, 135.0, 1.1);
    scene.add(truth_, size_m_);
    return scene;
  }();
  int right_ = 0;
};

TEST_F(ObjectJobs, WithEveryMethodOfEveryStageNeitherTouchTheHeapNorAcceptAWrongPose) {
  for (const MethodCase& detector : test::every_choice(keypoint_detectors(), "")) {
    for (const MethodCase& descriptor : test::every_choice(descriptor_estimators(), "")) {
      Chosen chosen;
      chosen.detector = detector;
      chosen.descriptor = descriptor;
      run(chosen);
    }
  }
  for (const MethodCase& metric : test::every_choice(feature_matchers(), "metric")) {
    Chosen chosen;
    chosen.matcher = metric;
    run(chosen);
  }
  for (const MethodCase& rejector : test::every_choice(correspondence_rejectors(), "keep")) {
    Chosen chosen;
    chosen.rejector = rejector;
    run(chosen);
  }
  for (const MethodCase& generator : test::every_choice(hypothesis_generators(), "")) {
    for (const MethodCase& refiner : test::every_choice(pose_refiners(), "metric")) {
      Chosen chosen;
      chosen.generator = generator;
      chosen.refiner = refiner;
      run(chosen);
    }
  }
  EXPECT_GT(right_, 0);
}

}  // namespace
}  // namespace grapnel
