// The whole pipeline on simulated frames of a box on a belt.
#include "pipeline/registrar.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cstring>
#include <filesystem>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "base/input_error.h"
#include "base/rng.h"
#include "pipeline/kernels/target.h"
#include "tests/pipeline/support/box_scene.h"
#include "tests/support/heap_guard.h"

namespace grapnel {
namespace {

constexpr double kBelt_m = 1.1;
const Vec3d kSize_m = {0.4, 0.3, 0.2};

Preset box_preset(const std::vector<std::string>& overrides = {}) {
  const std::filesystem::path config = std::filesystem::path(GRAPNEL_SOURCE_DIR) / "config";
  Preset preset = load_preset(config / "presets" / "11-box.toml", config / "models", overrides);
  preset.models = {test::box_model(kSize_m, 0.005)};
  return preset;
}

test::BoxScene scene_with(const std::vector<Pose>& boxes, const Vec3d& size_m = kSize_m) {
  test::BoxScene scene(640, 480, 540.0, kBelt_m);
  for (const Pose& pose : boxes) scene.add(pose, size_m);
  scene.add_noise(17);
  return scene;
}

Pose place(double x_m, double y_m, double yaw_rad) {
  return test::lying(kSize_m, kBelt_m, x_m, y_m, yaw_rad);
}

std::string reasons_of(const RegistrationReport& report) {
  std::string all;
  for (const Reason& reason : report.reasons) {
    std::array<char, 200> text{};
    reason_text(reason, text.data(), text.size());
    all.append(text.data()).append("; ");
  }
  return all;
}

/// What a report says, bit by bit, without its times.
void expect_same(const RegistrationReports& a, const RegistrationReports& b) {
  ASSERT_EQ(a.objects.size(), b.objects.size());
  EXPECT_EQ(a.seed, b.seed);
  EXPECT_EQ(a.code, b.code);
  for (std::size_t i = 0; i < a.objects.size(); ++i) {
    const RegistrationReport& p = a.objects[i];
    const RegistrationReport& q = b.objects[i];
    EXPECT_EQ(0, std::memcmp(p.target_from_source.matrix().data(),
                             q.target_from_source.matrix().data(), 16 * sizeof(double)));
    EXPECT_EQ(0, std::memcmp(p.covariance.data(), q.covariance.data(), 36 * sizeof(double)));
    for (const auto& [x, y] : {std::pair{p.fitness, q.fitness},
                               {p.rmse_m, q.rmse_m},
                               {p.coverage, q.coverage},
                               {p.margin, q.margin},
                               {p.quality, q.quality},
                               {p.sigma_m, q.sigma_m}}) {
      EXPECT_EQ(0, std::memcmp(&x, &y, sizeof x));
    }
  }
}

RegistrationReport report_of_one(Registrar& registrar, const test::BoxScene& scene) {
  const Result<RegistrationReports> result = registrar.run(scene.frame(), {});
  EXPECT_TRUE(result.ok());
  EXPECT_EQ(result.value().objects.size(), 1U);
  return result.value().objects[0];
}

TEST(Registrar, FindsTheBoxWhereverItLies) {
  const auto registrar = Registrar::create(box_preset());
  for (const Pose& truth :
       {place(0.0, 0.0, 0.0), place(0.1, -0.05, 0.7), place(-0.12, 0.08, 2.2)}) {
    const test::BoxScene scene = scene_with({truth});
    const Result<RegistrationReports> result = registrar->run(scene.frame(), {});
    ASSERT_TRUE(result.ok());
    ASSERT_EQ(result.value().objects.size(), 1U);
    const RegistrationReport& report = result.value().objects[0];
    EXPECT_TRUE(report.accepted) << reasons_of(report);
    EXPECT_EQ(result.value().code, Code::ObjectFound);
    // Surface noise averages out; an outline along the pixel rows is known to one pixel of the
    // thinned view, 3.5 mm, and half of that where two sides differ.
    const Pose found = nearest_equivalent(report.target_from_source, truth, Symmetry::Box);
    EXPECT_LT((found.translation() - truth.translation()).norm(), 0.003);
    EXPECT_LT(rotation_angle_rad(found, truth), 0.01);
  }
}

TEST(Registrar, AnEmptyBeltIsNotAnObject) {
  const auto registrar = Registrar::create(box_preset());
  const test::BoxScene scene = scene_with({});
  const Result<RegistrationReports> result = registrar->run(scene.frame(), {});
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, Code::RoiEmpty);
  const Result<double> share = registrar->occupied_share(scene.frame(), {});
  ASSERT_TRUE(share.ok());
  EXPECT_LT(share.value(), 0.001);
}

TEST(Registrar, TheOccupiedShareIsThatOfTheBox) {
  const auto registrar = Registrar::create(box_preset());
  const test::BoxScene scene = scene_with({place(0.0, 0.0, 0.0)});
  const Result<double> share = registrar->occupied_share(scene.frame(), {});
  ASSERT_TRUE(share.ok());
  // The top at 0.9 m and what of the sides stands above the belt.
  EXPECT_NEAR(share.value(), 0.4 * 0.3 * 540.0 * 540.0 / (0.9 * 0.9) / (640.0 * 480.0), 0.015);
}

TEST(Registrar, ABoxOfAnotherSizeIsRejected) {
  const auto registrar = Registrar::create(box_preset());
  for (const Vec3d& size_m : {Vec3d(0.44, 0.33, 0.22), Vec3d(0.36, 0.27, 0.2),
                              Vec3d(0.4, 0.24, 0.2), Vec3d(0.3, 0.3, 0.3)}) {
    const test::BoxScene scene =
        scene_with({test::lying(size_m, kBelt_m, 0.03, -0.02, 0.5)}, size_m);
    const Result<RegistrationReports> result = registrar->run(scene.frame(), {});
    ASSERT_TRUE(result.ok());
    ASSERT_FALSE(result.value().objects.empty());
    const RegistrationReport& report = result.value().objects[0];
    EXPECT_FALSE(report.accepted) << size_m.transpose();
    EXPECT_FALSE(report.reasons.empty());
    EXPECT_EQ(report.code, report.reasons[0].code());
    EXPECT_EQ(result.value().code, report.code);
  }
}

Preset general_preset(const Model& model) {
  const std::filesystem::path config = std::filesystem::path(GRAPNEL_SOURCE_DIR) / "config";
  Preset preset = load_preset(config / "presets" / "01-object.toml", config / "models", {});
  preset.models = {model};
  return preset;
}

// Seen from above a height shows only in what lies beside the part.
TEST(Registrar, TheGeneralPresetKnowsABoxOfAnotherHeightByTheBeltBesideIt) {
  const auto registrar = Registrar::create(general_preset(test::box_model(kSize_m, 0.005)));
  for (const double height_m : {0.2, 0.187, 0.215, 0.35}) {
    const Vec3d size_m(kSize_m.x(), kSize_m.y(), height_m);
    const test::BoxScene scene =
        scene_with({test::lying(size_m, kBelt_m, 0.03, -0.02, 0.5)}, size_m);
    const Result<RegistrationReports> result = registrar->run(scene.frame(), {});
    ASSERT_TRUE(result.ok());
    ASSERT_FALSE(result.value().objects.empty());
    const RegistrationReport& report = result.value().objects[0];
    EXPECT_EQ(report.accepted, height_m == kSize_m.z()) << height_m << " " << reasons_of(report);
  }
}

TEST(Registrar, TheGeneralPresetAcceptsABoxOnAPlateOfWhichItSeesTheRim) {
  const auto registrar = Registrar::create(general_preset(test::box_model(kSize_m, 0.005)));
  const Vec3d plate_m(0.6, 0.5, 0.03);
  for (const double height_m : {kSize_m.z(), kSize_m.z() - plate_m.z()}) {
    const Vec3d size_m(kSize_m.x(), kSize_m.y(), height_m);
    test::BoxScene scene(640, 480, 540.0, kBelt_m);
    scene.add(test::lying(plate_m, kBelt_m, 0.0, 0.0, 0.5), plate_m);
    scene.add(test::lying(size_m, kBelt_m - plate_m.z(), 0.0, 0.0, 0.5), size_m);
    scene.add_noise(17);
    const Result<RegistrationReports> result = registrar->run(scene.frame(), {});
    ASSERT_TRUE(result.ok());
    ASSERT_FALSE(result.value().objects.empty());
    const RegistrationReport& report = result.value().objects[0];
    EXPECT_EQ(report.accepted, height_m == kSize_m.z()) << height_m << " " << reasons_of(report);
  }
}

// Half of the cells as wide as the mean distance to the nearest point hold none.
TEST(Registrar, FindsABoxWhoseModelWasSampledAtRandom) {
  Rng rng(3);
  CloudData cloud;
  for (int i = 0; i < 16000; ++i) {
    // Areas of the three pairs of faces are 12, 8 and 6.
    const std::uint32_t lot = rng.below(26);
    const int axis = lot < 12 ? 2 : (lot < 20 ? 1 : 0);
    Vec3d normal = Vec3d::Zero();
    normal[axis] = rng.below(2) == 0 ? 1.0 : -1.0;
    Vec3d p = 0.5 * kSize_m.cwiseProduct(normal);
    for (const int other : {(axis + 1) % 3, (axis + 2) % 3}) {
      p[other] = kSize_m[other] * rng.uniform(-0.5, 0.5);
    }
    cloud.x.push_back(static_cast<float>(p.x()));
    cloud.y.push_back(static_cast<float>(p.y()));
    cloud.z.push_back(static_cast<float>(p.z()));
    cloud.nx.push_back(static_cast<float>(normal.x()));
    cloud.ny.push_back(static_cast<float>(normal.y()));
    cloud.nz.push_back(static_cast<float>(normal.z()));
  }
  cloud.width = static_cast<int>(cloud.size());
  Model model = model_from_cloud(cloud, "random");
  model.symmetry = Symmetry::Box;
  const auto registrar = Registrar::create(general_preset(model));
  const Pose truth = place(0.05, 0.03, 0.5);
  const Result<RegistrationReports> result = registrar->run(scene_with({truth}).frame(), {});
  ASSERT_TRUE(result.ok());
  ASSERT_FALSE(result.value().objects.empty());
  const RegistrationReport& report = result.value().objects[0];
  EXPECT_TRUE(report.accepted) << reasons_of(report);
  const Pose found = nearest_equivalent(report.target_from_source, truth, Symmetry::Box);
  EXPECT_LT((found.translation() - truth.translation()).norm(), 0.003);
}

TEST(Registrar, LooksForFeaturesOnlyWhereAGeneratorUsesThem) {
  const test::BoxScene scene = scene_with({place(0.02, 0.01, 0.4)});
  for (const bool by_features : {true, false}) {
    const std::string method = by_features ? "surface_ransac" : "plane_frames";
    const auto registrar = Registrar::create(box_preset({"coarse.method=" + method}));
    const Result<RegistrationReports> result = registrar->run(scene.frame(), {});
    ASSERT_TRUE(result.ok());
    EXPECT_TRUE(result.value().objects[0].accepted) << reasons_of(result.value().objects[0]);
    EXPECT_EQ(result.value().counts.target_keypoints > 0, by_features);
  }
}

TEST(Registrar, APartThatTwoModelsFitIsAmbiguous) {
  // 2 mm less in height: within what the camera measures, so both fit.
  Preset preset = box_preset();
  preset.models.push_back(test::box_model(kSize_m - Vec3d(0.0, 0.0, 0.002), 0.005));
  preset.models.back().name = "lower box";
  const auto registrar = Registrar::create(preset);
  const test::BoxScene scene = scene_with({place(0.0, 0.0, 0.4)});
  JobContext either_alone;
  for (const std::uint32_t mask : {1U, 2U}) {
    either_alone.model_mask = mask;
    const Result<RegistrationReports> alone = registrar->run(scene.frame(), either_alone);
    ASSERT_TRUE(alone.ok());
    EXPECT_TRUE(alone.value().objects[0].accepted) << reasons_of(alone.value().objects[0]);
  }
  const Result<RegistrationReports> result = registrar->run(scene.frame(), {});
  ASSERT_TRUE(result.ok());
  EXPECT_FALSE(result.value().objects[0].accepted);
  EXPECT_EQ(result.value().code, Code::Ambiguous);
}

TEST(Registrar, APartThatLooksTheSameTurnedNamesBothPoses) {
  Preset preset = box_preset();
  preset.models = {model_from_cloud(test::box_cloud(kSize_m, 0.005), "box of no symmetry")};
  ASSERT_EQ(preset.models[0].symmetry, Symmetry::None);
  const auto registrar = Registrar::create(preset);
  const Pose truth = place(0.05, 0.02, 0.4);
  const RegistrationReport report = report_of_one(*registrar, scene_with({truth}));
  EXPECT_FALSE(report.accepted);
  EXPECT_EQ(report.code, Code::Ambiguous) << reasons_of(report);
  ASSERT_TRUE(report.has_rival);
  EXPECT_GT(rotation_angle_rad(report.target_from_source, report.target_from_rival), 3.0);
  // Either would be right for a box, as in FindsTheBoxWhereverItLies; the rival is not refined.
  for (const Pose& pose : {report.target_from_source, report.target_from_rival}) {
    const Pose found = nearest_equivalent(pose, truth, Symmetry::Box);
    EXPECT_LT((found.translation() - truth.translation()).norm(), 0.005);
    EXPECT_LT(rotation_angle_rad(found, truth), 0.02);
  }
}

/// A box with a block on its top near one corner: nothing but the block tells it from its mirror
/// image, in which the block lies at the other end of x.
struct BlockedBox {
  static constexpr double kBlock_m = 0.03;
  Vec3d body_m = {0.4, 0.3, 0.2};
  Vec3d block_m = {0.1, 0.08, kBlock_m};
  Vec3d block_at = {-0.11, -0.07, 0.1 + 0.5 * kBlock_m};

  [[nodiscard]] Model model() const {
    CloudData cloud = test::box_cloud(body_m, 0.005);
    const CloudData block = test::box_cloud(block_m, 0.005);
    for (std::size_t i = 0; i < block.size(); ++i) {
      if (block.nz[i] < -0.5F) continue;  // the block's underside is none
      cloud.x.push_back(block.x[i] + static_cast<float>(block_at.x()));
      cloud.y.push_back(block.y[i] + static_cast<float>(block_at.y()));
      cloud.z.push_back(block.z[i] + static_cast<float>(block_at.z()));
      cloud.nx.push_back(block.nx[i]);
      cloud.ny.push_back(block.ny[i]);
      cloud.nz.push_back(block.nz[i]);
    }
    cloud.width = static_cast<int>(cloud.size());
    return model_from_cloud(cloud, "blocked box");
  }
  /// The part, or its mirror image, in a frame.
  [[nodiscard]] test::BoxScene scene(const Pose& camera_from_part, bool mirrored) const {
    test::BoxScene scene(640, 480, 540.0, kBelt_m);
    scene.add(camera_from_part, body_m);
    Vec3d at = block_at;
    if (mirrored) at.x() = -at.x();
    Pose block = camera_from_part;
    block.translation() = camera_from_part * at;
    scene.add(block, block_m);
    scene.add_noise(17);
    return scene;
  }
  /// The block up; or on a side, with the block hidden below the face that the camera sees.
  [[nodiscard]] static Pose block_up() {
    return test::lying({0.4, 0.3, 0.2}, kBelt_m, 0.02, 0.01, 0.3);
  }
  [[nodiscard]] static Pose on_its_side() {
    Pose pose = Pose::Identity();
    // z of the part to the image's right, away from its middle; x up the image, y toward the
    // camera.
    pose.linear().col(2) = Vec3d::UnitX();
    pose.linear().col(1) = -Vec3d::UnitZ();
    pose.linear().col(0) = pose.linear().col(1).cross(pose.linear().col(2));
    pose.translation() = Vec3d(0.10, 0.0, kBelt_m - 0.15);
    return pose;
  }
};

TEST(Registrar, APartWhoseTellingBlockIsSeenIsToldFromItsMirrorImage) {
  const BlockedBox part;
  Preset preset = box_preset();
  preset.models = {part.model()};
  const auto registrar = Registrar::create(preset);
  const RegistrationReport report =
      report_of_one(*registrar, part.scene(BlockedBox::block_up(), false));
  EXPECT_TRUE(report.accepted) << reasons_of(report);
  EXPECT_GT(report.measured[Check::Mirror], 0.3F);
  EXPECT_FALSE(report_of_one(*registrar, part.scene(BlockedBox::block_up(), true)).accepted);
}

TEST(Registrar, APartWhoseMirrorImageFitsAsWellIsAmbiguous) {
  const BlockedBox part;
  Preset preset = box_preset();
  preset.models = {part.model()};
  const auto judging = Registrar::create(preset);
  preset = box_preset({"accept.min_mirror_margin=0"});
  preset.models = {part.model()};
  const auto careless = Registrar::create(preset);
  for (const bool mirrored : {false, true}) {
    const test::BoxScene scene = part.scene(BlockedBox::on_its_side(), mirrored);
    const RegistrationReport report = report_of_one(*judging, scene);
    EXPECT_FALSE(report.accepted);
    EXPECT_EQ(report.code, Code::Ambiguous);
    EXPECT_EQ(reasons_of(report).find("its mirror image fits as well"), 0U) << reasons_of(report);
    // There is no other reason.
    const RegistrationReport unasked = report_of_one(*careless, scene);
    EXPECT_TRUE(unasked.accepted) << reasons_of(unasked);
  }
}

TEST(Registrar, AHandInViewWithoutThePartIsRejected) {
  const auto registrar = Registrar::create(box_preset());
  test::BoxScene scene(640, 480, 540.0, kBelt_m);
  const Vec3d arm_m(0.1, 0.5, 0.08);
  scene.add(test::lying(arm_m, kBelt_m - 0.15, 0.05, 0.1, 0.3), arm_m);
  scene.add_noise(3);
  const Result<RegistrationReports> result = registrar->run(scene.frame(), {});
  if (result.ok()) {
    for (const RegistrationReport& report : result.value().objects) EXPECT_FALSE(report.accepted);
  }
}

TEST(Registrar, ReportsAsManyObjectsAsWanted) {
  const auto registrar = Registrar::create(box_preset({"max_objects=4"}));
  const Vec3d small_m = kSize_m;
  test::BoxScene scene(640, 480, 400.0, 1.4);
  // So far aside that no side is seen at 80 degrees and more, where nothing is predicted.
  const Pose left = test::lying(small_m, 1.4, -0.55, 0.0, 0.2);
  const Pose right = test::lying(small_m, 1.4, 0.55, 0.1, 1.1);
  scene.add(left, small_m);
  scene.add(right, small_m);
  scene.add_noise(5);
  const Result<RegistrationReports> both = registrar->run(scene.frame(), {});
  ASSERT_TRUE(both.ok());
  ASSERT_EQ(both.value().objects.size(), 2U);
  int seen = 0;
  for (const RegistrationReport& report : both.value().objects) {
    EXPECT_TRUE(report.accepted) << reasons_of(report);
    if (equivalent(report.target_from_source, left, Symmetry::Box, 0.004, 0.02)) seen |= 1;
    if (equivalent(report.target_from_source, right, Symmetry::Box, 0.004, 0.02)) seen |= 2;
  }
  EXPECT_EQ(seen, 3);
  JobContext one;
  one.max_objects = 1;
  const Result<RegistrationReports> first = registrar->run(scene.frame(), one);
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(first.value().objects.size(), 1U);
}

TEST(Registrar, GivesTheSameBitsOnEveryRunAndTarget) {
  const auto registrar = Registrar::create(box_preset());
  const test::BoxScene scene = scene_with({place(0.07, 0.03, 1.0)});
  const Result<RegistrationReports> first = registrar->run(scene.frame(), {});
  ASSERT_TRUE(first.ok());
  const test::BoxScene other = scene_with({place(-0.05, 0.02, 0.3)});
  ASSERT_TRUE(registrar->run(other.frame(), {}).ok());
  const Result<RegistrationReports> again = registrar->run(scene.frame(), {});
  ASSERT_TRUE(again.ok());
  expect_same(first.value(), again.value());
  for (const std::string& target : kernels::target_names()) {
    ASSERT_TRUE(Registrar::force_simd_target(target));
    // The model's features are made anew on this target, too.
    const auto own = Registrar::create(box_preset());
    const Result<RegistrationReports> result = own->run(scene.frame(), {});
    ASSERT_TRUE(result.ok());
    expect_same(first.value(), result.value());
  }
  ASSERT_TRUE(Registrar::force_simd_target(""));
}

TEST(Registrar, TakesNoMemoryFromTheHeapInAJob) {
  if (!test::heap_guard_works()) GTEST_SKIP() << test::kNoHeapGuard;
  const auto registrar = Registrar::create(box_preset());
  const test::BoxScene scene = scene_with({place(0.07, 0.03, 1.0)});
  const MonotonicClock clock;
  JobContext context;
  context.clock = &clock;
  test::clear_first_heap_call();
  test::arm_heap_guard();
  const Result<RegistrationReports> result = registrar->run(scene.frame(), context);
  const Result<double> share = registrar->occupied_share(scene.frame(), context);
  test::disarm_heap_guard();
  EXPECT_TRUE(result.ok());
  EXPECT_TRUE(share.ok());
  EXPECT_EQ(test::heap_calls(), 0U) << test::first_heap_call();
}

TEST(Registrar, UsesExactlyThePlannedMemory) {
  const Preset preset = box_preset();
  const std::vector<MemoryItem> plan = Registrar::plan(preset);
  const std::size_t sum =
      std::accumulate(plan.begin(), plan.end(), std::size_t{0},
                      [](std::size_t bytes, const MemoryItem& item) { return bytes + item.bytes; });
  EXPECT_EQ(sum, Registrar::required_bytes(preset));
  EXPECT_EQ(Registrar::create(preset)->used_bytes(), sum);
}

TEST(Registrar, ChargesTheStagesAndStopsAtTheDeadline) {
  const auto registrar = Registrar::create(box_preset());
  const test::BoxScene scene = scene_with({place(0.0, 0.0, 0.4)});
  const MonotonicClock clock;
  JobContext context;
  context.clock = &clock;
  const Result<RegistrationReports> timed = registrar->run(scene.frame(), context);
  ASSERT_TRUE(timed.ok());
  const StageTimes& times = timed.value().stage_us;
  const std::uint32_t sum = std::accumulate(times.begin(), times.end(), 0U);
  EXPECT_EQ(sum, timed.value().total_us);
  EXPECT_GT(times[static_cast<std::size_t>(Stage::Refine)], 0U);

  context.deadline_us = clock.now_us() - 1;
  const Result<RegistrationReports> late = registrar->run(scene.frame(), context);
  ASSERT_FALSE(late.ok());
  EXPECT_EQ(late.error().code, Code::JobDeadline);

  std::atomic<bool> abort{true};
  context.deadline_us = 0;
  context.abort = &abort;
  const Result<RegistrationReports> aborted = registrar->run(scene.frame(), context);
  ASSERT_FALSE(aborted.ok());
  EXPECT_EQ(aborted.error().code, Code::Aborted);
}

TEST(Registrar, DegenerateFramesAreErrors) {
  const auto registrar = Registrar::create(box_preset());
  test::TestFrame empty(640, 480, 540.0);
  EXPECT_FALSE(registrar->run(empty.frame, {}).ok());
  empty.at(320, 240) = 1000;
  EXPECT_FALSE(registrar->run(empty.frame, {}).ok());
  for (std::uint16_t& count : empty.counts) count = 65535;
  EXPECT_FALSE(registrar->run(empty.frame, {}).ok());
  test::TestFrame large(1280, 960, 540.0);
  EXPECT_FALSE(registrar->run(large.frame, {}).ok());
}

TEST(Registrar, RefusesMemoryThatIsTooSmall) {
  const Preset preset = box_preset();
  alignas(Arena::kAlignment) static std::array<std::byte, 4096> little;
  EXPECT_THROW(static_cast<void>(Registrar::create(preset, little)), InputError);
}

}  // namespace
}  // namespace grapnel
