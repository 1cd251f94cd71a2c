// Hypotheses from shapes: planes, cylinders, pairs of points.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "base/config.h"
#include "pipeline/coarse/cylinder_axes.h"
#include "pipeline/coarse/pair_voting.h"
#include "pipeline/coarse/plane_frames.h"
#include "pipeline/coarse/pose_score.h"
#include "pipeline/coarse/resting_poses.h"
#include "pipeline/registry.h"
#include "tests/pipeline/support/shapes.h"
#include "tests/support/heap_guard.h"

namespace grapnel {
namespace {

using test::barrel_surface;
using test::box_surface;
using test::kShapeSpacing_m;
using test::OwnedSurface;
using test::seen;

Pose some_pose() {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3d(2.1, 0.4, -0.7));
  pose.translation() = Vec3d(0.1, -0.05, 1.2);
  return pose;
}

/// Two surfaces with a score between them, and a generator of the registry.
struct Search {
  std::unique_ptr<HypothesisGenerator> generator;
  ClosestPointTable source_table, target_table;
  SampleSet source_samples, target_samples;
  std::span<Hypothesis> storage;
  PoseScore score;
  PairView pair;
  Hypotheses hypotheses;
  test::ArenaMemory memory;

  Search(const char* name, const Surface& source, const Surface& target)
      : generator(make(name)), memory([&](Arena& arena) {
          Limits limits;
          generator->reserve(arena, limits);
          for (ClosestPointTable* table : {&source_table, &target_table}) {
            table->reserve(arena, 100000);
          }
          for (SampleSet* samples : {&source_samples, &target_samples}) {
            samples->reserve(arena, 256);
          }
          storage = arena.take<Hypothesis>(16);
        }) {
    source_table.build(source, 0.05);
    target_table.build(target, 0.05);
    source_samples.draw(source, Rng(1));
    target_samples.draw(target, Rng(2));
    score = PoseScore({&source_samples, &source_table, &source, nullptr},
                      {nullptr, &target_table, &target, &target_samples}, 0.015F);
    pair = {&source, &target, {}, {}, &score};
    hypotheses = Hypotheses(storage);
  }

  static std::unique_ptr<HypothesisGenerator> make(const char* name) {
    const ConfigTable empty("", "coarse", 0);
    ConfigReader reader(empty);
    return find_method(hypothesis_generators(), name).make(reader);
  }
  Status run() {
    hypotheses.clear();
    Rng rng(3);
    return generator->generate(pair, {}, rng, hypotheses);
  }
};

/// Displacement of the nearest of the hypotheses from the truth or one of its equals.
double nearest_m(const Hypotheses& hypotheses, const Pose& truth, Symmetry symmetry,
                 double radius_m) {
  double least_m = 1e9;
  for (const Hypothesis& hypothesis : hypotheses) {
    const Pose found = nearest_equivalent(hypothesis.target_from_source, truth, symmetry);
    const double turn_rad = rotation_angle_rad(found, truth);
    least_m =
        std::min(least_m, (found.translation() - truth.translation()).norm() + turn_rad * radius_m);
  }
  return least_m;
}

TEST(PlanePatches, AreTheSixFacesOfABox) {
  OwnedSurface box = box_surface({0.4, 0.3, 0.2});
  PlanePatches planes;
  const test::ArenaMemory memory([&](Arena& arena) { planes.reserve(arena, box->size); });
  planes.find(*box, {}, Rng(1));
  ASSERT_EQ(planes.patches().size(), 6U);
  for (std::size_t k = 0; k < 6; ++k) {
    const PlanePatch& patch = planes.patches()[k];
    Vec3d::Index axis = 0;
    EXPECT_GT(patch.normal.cwiseAbs().maxCoeff(&axis), 0.9999);
    EXPECT_NEAR(patch.offset_m, 0.5 * Vec3d(0.4, 0.3, 0.2)[axis], 0.001);
    // A spacing of the neighbouring faces belongs to each.
    const PlanePatches::Rectangle face = planes.rectangle(*box, k);
    Vec3d size_m(0.4, 0.3, 0.2);
    size_m[axis] = 0.0;
    EXPECT_NEAR(face.length_m, size_m.maxCoeff(), kShapeSpacing_m + 0.001);
    EXPECT_NEAR(face.length_m * face.width_m,
                size_m.x() * size_m.y() + size_m.y() * size_m.z() + size_m.z() * size_m.x(), 0.008);
    EXPECT_LT(face.middle.cross(patch.normal).norm(), 0.004);
  }
}

TEST(CylinderFit, MeasuresABarrelSeenFromOneSide) {
  OwnedSurface barrel = barrel_surface(0.14, 0.34);
  const Pose pose = some_pose();
  // A Kinect's noise at 1.2 m.
  OwnedSurface view = seen(*barrel, pose, 0.002);
  Cylinder cylinder;
  ASSERT_TRUE(fit_cylinder(*view, {}, Rng(5), cylinder));
  EXPECT_NEAR(cylinder.radius_m, 0.14, 0.002);
  EXPECT_GT(std::fabs(cylinder.axis.dot(pose.linear().col(2))), std::cos(0.02));
  EXPECT_LT((cylinder.middle - pose.translation()).cross(cylinder.axis).norm(), 0.003);
  EXPECT_NEAR(cylinder.high_m - cylinder.low_m, 0.34, 0.012);
  EXPECT_LT(cylinder.rmse_m, 0.003);
  EXPECT_GT(cylinder.arc_rad, 2.0);
  EXPECT_LT(cylinder.arc_rad, 3.5);
}

TEST(CylinderFit, FindsNoneInABox) {
  OwnedSurface box = box_surface({0.4, 0.3, 0.2});
  OwnedSurface view = seen(*box, some_pose(), 0.002);
  Cylinder cylinder;
  EXPECT_FALSE(fit_cylinder(*view, {}, Rng(5), cylinder));
}

TEST(PlaneFrames, PlaceABoxByThreeOfItsFaces) {
  OwnedSurface box = box_surface({0.4, 0.3, 0.2});
  OwnedSurface view = seen(*box, some_pose(), 0.002);
  Search search("plane_frames", *box, *view);
  ASSERT_TRUE(search.run().ok());
  // What coarse refinement bridges with ease.
  EXPECT_LT(nearest_m(search.hypotheses, some_pose(), Symmetry::Box, 0.27), 0.02);
}

TEST(PlaneFrames, PlaceABoxByItsTopAlone) {
  OwnedSurface box = box_surface({0.4, 0.3, 0.2});
  Pose truth = Pose::Identity();
  truth.linear() = rotation_from_vector(Vec3d(3.14159265, 0.0, 0.0)) *
                   rotation_from_vector(Vec3d(0.0, 0.0, 0.7));
  truth.translation() = Vec3d(0.0, 0.0, 1.1);
  OwnedSurface view = seen(*box, truth, 0.002);
  Search search("plane_frames", *box, *view);
  ASSERT_TRUE(search.run().ok());
  EXPECT_LT(nearest_m(search.hypotheses, truth, Symmetry::Box, 0.27), 0.03);
}

TEST(PlaneFrames, PlaceABoxOfWhichAThirdIsHidden) {
  OwnedSurface box = box_surface({0.4, 0.3, 0.2});
  OwnedSurface view = seen(*box, some_pose(), 0.002);
  const Pose model_from_camera = some_pose().inverse();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < view->size; ++i) {
    if ((model_from_camera * view->point(i).cast<double>()).x() > 0.07) continue;
    for (std::span<float>* plane :
         {&view->x, &view->y, &view->z, &view->nx, &view->ny, &view->nz}) {
      (*plane)[kept] = (*plane)[i];
    }
    ++kept;
  }
  view->size = kept;
  Search search("plane_frames", *box, *view);
  ASSERT_TRUE(search.run().ok());
  EXPECT_LT(nearest_m(search.hypotheses, some_pose(), Symmetry::Box, 0.27), 0.02);
}

TEST(CylinderAxes, PlaceABarrel) {
  OwnedSurface barrel = barrel_surface(0.14, 0.34);
  OwnedSurface view = seen(*barrel, some_pose(), 0.002);
  Search search("cylinder_axes", *barrel, *view);
  ASSERT_TRUE(search.run().ok());
  EXPECT_LT(nearest_m(search.hypotheses, some_pose(), Symmetry::AxisZFlip, 0.2), 0.02);
}

TEST(PairVoting, PlacesABoxAndABarrel) {
  OwnedSurface box = box_surface({0.4, 0.3, 0.2});
  OwnedSurface box_view = seen(*box, some_pose(), 0.002);
  Search boxes("pair_voting", *box, *box_view);
  ASSERT_TRUE(boxes.run().ok());
  // Votes are 12 degrees and a twentieth of the diameter wide.
  EXPECT_LT(nearest_m(boxes.hypotheses, some_pose(), Symmetry::Box, 0.27), 0.08);

  OwnedSurface barrel = barrel_surface(0.14, 0.34);
  OwnedSurface barrel_view = seen(*barrel, some_pose(), 0.002);
  Search barrels("pair_voting", *barrel, *barrel_view);
  ASSERT_TRUE(barrels.run().ok());
  EXPECT_LT(nearest_m(barrels.hypotheses, some_pose(), Symmetry::AxisZFlip, 0.2), 0.06);
}

TEST(PairVoting, LearnsAnotherModelWhenItChanges) {
  OwnedSurface box = box_surface({0.4, 0.3, 0.2});
  OwnedSurface other = box_surface({0.5, 0.2, 0.1});
  OwnedSurface view = seen(*box, some_pose(), 0.0);
  Search search("pair_voting", *box, *view);
  ASSERT_TRUE(search.run().ok());
  std::vector<Hypothesis> first(search.hypotheses.begin(), search.hypotheses.end());
  search.pair.source = &*other;
  ASSERT_TRUE(search.run().ok());
  search.pair.source = &*box;
  ASSERT_TRUE(search.run().ok());
  ASSERT_EQ(search.hypotheses.size(), first.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(search.hypotheses[i].target_from_source.matrix(),
              first[i].target_from_source.matrix());
  }
}

TEST(RestingPoses, ABoxRestsOnItsSixFaces) {
  OwnedSurface box = box_surface({0.4, 0.3, 0.2});
  RestingPoses generator{{}};
  const test::ArenaMemory memory([&](Arena& arena) { generator.reserve(arena, {}); });
  generator.find_sides(*box);
  ASSERT_EQ(generator.sides().size(), 6U);
  for (const RestingPoses::Side& side : generator.sides()) {
    Vec3d::Index axis = 0;
    EXPECT_GT(side.down.cwiseAbs().maxCoeff(&axis), 0.9999);
    // Points of the walls just above the contact lean it by up to half a degree.
    EXPECT_NEAR(side.reach_m, 0.5 * Vec3d(0.4, 0.3, 0.2)[axis], 0.002);
  }
}

TEST(RestingPoses, PlaceABoxOnItsGround) {
  OwnedSurface box = box_surface({0.4, 0.3, 0.2});
  OwnedSurface view = seen(*box, some_pose(), 0.002);
  Search search("resting_poses", *box, *view);
  EXPECT_EQ(search.run().error().code, Code::NoConsensus) << "without a ground";
  Ground ground;
  ground.normal = some_pose().linear().col(2);
  ground.offset_m = -ground.normal.dot(some_pose() * Vec3d(0.0, 0.0, -0.1));
  search.pair.ground = &ground;
  ASSERT_TRUE(search.run().ok());
  EXPECT_LT(nearest_m(search.hypotheses, some_pose(), Symmetry::Box, 0.27), 0.05);
}

class ShapeGenerator : public testing::TestWithParam<const char*> {};

TEST_P(ShapeGenerator, AnswersTheSameTwiceAndTakesNothingFromTheHeap) {
  OwnedSurface barrel = barrel_surface(0.14, 0.34);
  OwnedSurface view = seen(*barrel, some_pose(), 0.002);
  Search search(GetParam(), *barrel, *view);
  const Ground ground = {some_pose().linear().col(2), -1.0};
  search.pair.ground = &ground;
  ASSERT_TRUE(search.run().ok());
  const Pose best = search.hypotheses[0].target_from_source;
  test::arm_heap_guard();
  const Status again = search.run();
  test::disarm_heap_guard();
  ASSERT_TRUE(again.ok());
  if (test::heap_guard_works()) {
    EXPECT_EQ(test::heap_calls(), 0U);
  }
  EXPECT_EQ(search.hypotheses[0].target_from_source.matrix(), best.matrix());
}

TEST_P(ShapeGenerator, EndsDegenerateSurfacesInAnErrorOrFinitePoses) {
  OwnedSurface box = box_surface({0.1, 0.1, 0.1});
  for (int shape = 0; shape < 5; ++shape) {
    OwnedSurface view = seen(*box, some_pose(), 0.0);
    for (std::size_t i = 0; i < view->size; ++i) {
      if (shape == 0) view->x[i] = view->y[i] = view->z[i] = 1.0F;
      if (shape == 1) view->x[i] = view->y[i] = view->z[i];
      if (shape == 2) view->nx[i] = view->ny[i] = view->nz[i] = 0.0F;
    }
    Search search(GetParam(), *box, *view);
    const Ground ground = {Vec3d(0.0, 0.0, -1.0), 1.3};
    search.pair.ground = &ground;
    // The score keeps what it was built of.
    if (shape == 3) view->size = 0;
    if (shape == 4) view->size = 2;
    const Status status = search.run();
    if (!status.ok()) {
      EXPECT_EQ(status.error().stage, Stage::Coarse);
      continue;
    }
    for (const Hypothesis& hypothesis : search.hypotheses) {
      EXPECT_TRUE(hypothesis.target_from_source.matrix().allFinite()) << shape;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OfShapes, ShapeGenerator,
                         testing::Values("plane_frames", "cylinder_axes", "pair_voting",
                                         "resting_poses"),
                         [](const auto& name) { return std::string(name.param); });

}  // namespace
}  // namespace grapnel
