// Several boxes under one camera: each found once, counted once, and those that touch named.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/object_reports.h"
#include "pipeline/registrar.h"
#include "pipeline/shared_space.h"
#include "tests/pipeline/support/box_scene.h"

namespace grapnel {
namespace {

constexpr double kBelt_m = 1.6;
const Vec3d kSize_m = {0.4, 0.3, 0.2};

/// At this distance the noise hides some of the outline.
Preset box_preset(const std::vector<std::string>& overrides = {"max_objects=8",
                                                               "accept.min_edge=0.65"}) {
  const std::filesystem::path config = std::filesystem::path(GRAPNEL_SOURCE_DIR) / "config";
  Preset preset = load_preset(config / "presets" / "11-box.toml", config / "models", overrides);
  preset.models = {test::box_model(kSize_m, 0.005)};
  return preset;
}

Pose place(double x_m, double y_m, double yaw_rad) {
  return test::lying(kSize_m, kBelt_m, x_m, y_m, yaw_rad);
}

RegistrationReports run(const std::vector<Pose>& boxes, const Preset& preset = box_preset()) {
  test::BoxScene scene(640, 480, 540.0, kBelt_m);
  for (const Pose& pose : boxes) scene.add(pose, kSize_m);
  scene.add_noise(23);
  const Result<RegistrationReports> result = Registrar::create(preset)->run(scene.frame(), {});
  EXPECT_TRUE(result.ok());
  return result.ok() ? result.value() : RegistrationReports{};
}

std::string reasons_of(const RegistrationReports& reports) {
  std::string all;
  for (const RegistrationReport& report : reports.objects) {
    for (const Reason& reason : report.reasons) {
      std::array<char, 200> text{};
      reason_text(reason, text.data(), text.size());
      all.append(text.data()).append("\n");
    }
  }
  return all;
}

std::size_t accepted_in(const RegistrationReports& reports) {
  return static_cast<std::size_t>(
      std::count_if(reports.objects.begin(), reports.objects.end(),
                    [](const RegistrationReport& report) { return report.accepted; }));
}

TEST(SeveralObjects, EachBoxIsFoundOnceAndCountedOnce) {
  const std::vector<Pose> truths = {place(-0.55, -0.35, 0.3), place(0.0, -0.4, 1.4),
                                    place(0.55, -0.3, 2.0), place(-0.5, 0.3, 0.9),
                                    place(0.1, 0.35, 0.1)};
  const RegistrationReports reports = run(truths);
  EXPECT_EQ(reports.found, truths.size());
  ASSERT_EQ(reports.objects.size(), truths.size());
  std::vector<int> times(truths.size(), 0);
  for (const RegistrationReport& report : reports.objects) {
    if (!report.accepted) continue;
    const auto is_it = [&](const Pose& truth) {
      // The noise at 1.4 m is 2.8 mm a reading; an outline is known to half a pixel's 2.6 mm.
      return equivalent(report.target_from_source, truth, Symmetry::Box, 0.005, 0.02);
    };
    const auto found = std::find_if(truths.begin(), truths.end(), is_it);
    ASSERT_NE(found, truths.end()) << "an accepted pose is wrong";
    EXPECT_EQ(++times[static_cast<std::size_t>(found - truths.begin())], 1);
  }
  // One of them lies near the image's end, where the preset may ask for more than is in view.
  EXPECT_GE(accepted_in(reports), truths.size() - 1) << reasons_of(reports);
}

TEST(SeveralObjects, WithoutViewsOfTheModelNothingIsTooLarge) {
  // The limit on a piece's size is in views of the part.
  const RegistrationReports reports = run({place(0.0, 0.1, 1.4)}, box_preset({"views.views=0"}));
  EXPECT_EQ(reports.found, 1U);
  ASSERT_EQ(reports.objects.size(), 1U);
  EXPECT_GT(reports.objects[0].counts.target_points, 0U) << "not looked at";
  for (const Reason& reason : reports.objects[0].reasons) {
    EXPECT_NE(reason.check, Check::Size) << reasons_of(reports);
  }
}

TEST(SeveralObjects, TheBestComeFirstAndNoMoreThanWanted) {
  const RegistrationReports reports =
      run({place(-0.5, 0.0, 0.3), place(0.0, 0.1, 1.4), place(0.5, -0.1, 2.0)},
          box_preset({"max_objects=2"}));
  ASSERT_EQ(reports.objects.size(), 2U);
  EXPECT_GE(reports.objects[0].quality, reports.objects[1].quality);
  EXPECT_EQ(reports.found, 3U);
}

TEST(SeveralObjects, TwoThatTouchFlushAreOnePieceAndRefusedByName) {
  // Side by side along x, a millimetre apart: no camera of 2.6 mm a pixel sees between.
  const RegistrationReports reports = run({place(-0.2005, 0.0, 0.0), place(0.2005, 0.0, 0.0)});
  EXPECT_EQ(reports.found, 1U);
  ASSERT_EQ(reports.objects.size(), 1U);
  const RegistrationReport& report = reports.objects[0];
  EXPECT_FALSE(report.accepted);
  EXPECT_EQ(report.code, Code::PartsTouch);
  ASSERT_FALSE(report.reasons.empty());
  EXPECT_EQ(report.reasons[0].check, Check::Size);
  // Two parts measure about two views of one.
  EXPECT_NEAR(report.reasons[0].measured, 2.0, 0.35);
}

TEST(SeveralObjects, ABlockTooLargeForALookIsRefusedByNameToo) {
  const RegistrationReports reports =
      run({place(-0.5, 0.151, 0.0), place(-0.099, 0.151, 0.0), place(-0.5, -0.151, 0.0),
           place(-0.099, -0.151, 0.0), place(0.52, 0.0, 0.5)});
  EXPECT_EQ(reports.found, 2U);
  ASSERT_EQ(reports.objects.size(), 2U);
  EXPECT_TRUE(reports.objects[0].accepted);
  EXPECT_TRUE(equivalent(reports.objects[0].target_from_source, place(0.52, 0.0, 0.5),
                         Symmetry::Box, 0.005, 0.02));
  EXPECT_EQ(reports.objects[1].code, Code::PartsTouch);
  EXPECT_FALSE(reports.objects[1].has_pose);
  // Four tops of 0.12 m², and no view of a box shows more than 0.18 m².
  EXPECT_GT(reports.objects[1].reasons[0].measured, 2.6);
}

TEST(SeveralObjects, OnlyPartsThatDoNotTouchAreAcceptedBesideThoseThatDo) {
  const RegistrationReports reports =
      run({place(-0.5, 0.25, 0.0), place(-0.5, -0.051, 0.0), place(0.4, 0.1, 0.7)});
  EXPECT_EQ(reports.found, 2U);
  EXPECT_EQ(accepted_in(reports), 1U);
  EXPECT_EQ(reports.objects[1].code, Code::PartsTouch);
}

/// A box of points as the pipeline holds it.
class BoxModelIndex {
 public:
  BoxModelIndex()
      : model_(test::box_model(kSize_m, 0.005)),
        memory_([&](Arena& arena) { index.reserve(arena, model_, params_, limits_, 33); }) {
    index.build(model_, params_, 0.01);
  }
  ModelIndex index;

 private:
  Model model_;
  ModelIndexParams params_;
  Limits limits_;
  test::ArenaMemory memory_;
};

Pose shifted(double x_m) {
  Pose pose = Pose::Identity();
  pose.translation().x() = x_m;
  return pose;
}

TEST(SharedSpace, OfAShiftedBoxIsTheShareOfItsEndFace) {
  const BoxModelIndex box;
  ASSERT_TRUE(box.index.closed);
  // Shifted by 0.3 of its 0.4 m, one end lies 0.1 m inside of the other box; the sides lie on its
  // sides, the middles outside. Of the end's 0.3 × 0.2 m all but a rim of the depth asked for is
  // inside.
  constexpr double kDepth_m = 0.02;
  const double expected =
      (0.3 - 2 * kDepth_m) * (0.2 - 2 * kDepth_m) / (2 * (0.4 * 0.3 + 0.4 * 0.2 + 0.3 * 0.2));
  // Points every 10 mm: the rim is known to half of that on each side.
  EXPECT_NEAR(shared_space(box.index, shifted(0.0), box.index, shifted(0.3), kDepth_m), expected,
              0.012);
}

TEST(SharedSpace, OfTwoInOnePoseIsAll) {
  const BoxModelIndex box;
  EXPECT_EQ(shared_space(box.index, shifted(0.0), box.index, shifted(0.005), 0.02), 1.0);
}

TEST(SharedSpace, OfBoxesSideBySideIsNone) {
  const BoxModelIndex box;
  EXPECT_EQ(shared_space(box.index, shifted(0.0), box.index, shifted(0.4), 0.01), 0.0);
  EXPECT_EQ(shared_space(box.index, shifted(0.0), box.index, shifted(2.0), 0.01), 0.0);
}

RegistrationReport accepted_at(const Pose& pose, double quality, std::uint32_t pieces) {
  RegistrationReport report;
  report.accepted = true;
  report.has_pose = true;
  report.code = Code::ObjectFound;
  report.target_from_source = pose;
  report.quality = quality;
  report.pieces = pieces;
  return report;
}

TEST(ObjectReports, OfTwoPartsInOnePlaceNeitherIsAccepted) {
  const BoxModelIndex box;
  RegistrationReports reports;
  ObjectReports objects(reports);
  objects.keep(accepted_at(shifted(0.0), 0.9, 1));
  objects.keep(accepted_at(shifted(0.2), 0.8, 2));
  objects.keep(accepted_at(shifted(0.9), 0.7, 4));
  objects.reject_shared_space({&box.index, 1}, {});
  objects.finish({}, 8);
  ASSERT_EQ(reports.objects.size(), 3U);
  EXPECT_TRUE(reports.objects[0].accepted);
  EXPECT_DOUBLE_EQ(reports.objects[0].target_from_source.translation().x(), 0.9);
  EXPECT_EQ(reports.objects[1].code, Code::HypothesesDisagree);
  EXPECT_EQ(reports.objects[2].code, Code::HypothesesDisagree);
}

TEST(ObjectReports, APoseFoundTwiceStaysOnce) {
  const BoxModelIndex box;
  RegistrationReports reports;
  ObjectReports objects(reports);
  objects.keep(accepted_at(shifted(0.0), 0.8, 1));
  objects.keep(accepted_at(shifted(0.005), 0.9, 2));
  objects.reject_shared_space({&box.index, 1}, {});
  objects.finish({}, 8);
  EXPECT_EQ(accepted_in(reports), 1U);
  EXPECT_DOUBLE_EQ(reports.objects[0].quality, 0.9);
}

TEST(ObjectReports, ARejectedWholeGivesWayToItsAcceptedPiece) {
  RegistrationReports reports;
  ObjectReports objects(reports);
  RegistrationReport whole;
  whole.fitness = 0.9;
  whole.pieces = 3;
  objects.keep(whole);
  objects.keep(accepted_at(shifted(0.0), 0.8, 1));
  objects.finish({}, 8);
  ASSERT_EQ(reports.objects.size(), 1U);
  EXPECT_TRUE(reports.objects[0].accepted);
  EXPECT_EQ(reports.found, 1U);
}

TEST(ObjectReports, ARejectionNamesTheNewReasonFirst) {
  RegistrationReport report = accepted_at(shifted(0.0), 0.9, 1);
  report.reasons.push_back({Check::Outline, 0.5, 0.7});
  reject_for({Check::Size, 2.0, 1.3}, report);
  EXPECT_FALSE(report.accepted);
  EXPECT_EQ(report.code, Code::PartsTouch);
  ASSERT_EQ(report.reasons.size(), 2U);
  EXPECT_EQ(report.reasons[0].check, Check::Size);
  EXPECT_EQ(report.reasons[1].check, Check::Outline);
}

}  // namespace
}  // namespace grapnel
