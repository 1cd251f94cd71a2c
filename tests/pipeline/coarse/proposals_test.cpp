#include <gtest/gtest.h>

#include <vector>

#include "pipeline/coarse/hypothesis_list.h"
#include "pipeline/coarse/triples.h"
#include "pipeline/model_index.h"
#include "tests/pipeline/support/box_scene.h"

namespace grapnel {
namespace {

TEST(HypothesisList, KeepsTheBestInOrder) {
  std::vector<Hypothesis> storage(3);
  Hypotheses list{storage};
  for (const double support : {1.0, 5.0, 2.0, 4.0, 0.5}) {
    keep_best(list, {Pose::Identity(), support});
  }
  ASSERT_EQ(list.size(), 3U);
  EXPECT_EQ(list[0].support, 5.0);
  EXPECT_EQ(list[1].support, 4.0);
  EXPECT_EQ(list[2].support, 2.0);
  EXPECT_FALSE(list.overflowed());
}

TEST(HypothesisList, DisplacementIsTheShiftPlusTheTurnsArc) {
  Pose shifted = Pose::Identity();
  shifted.translation() = Vec3d(0.3, 0.0, 0.4);
  EXPECT_NEAR(displacement_m(shifted, Pose::Identity(), Vec3d::Zero(), 1.0), 0.5, 1e-12);
  Pose turned = Pose::Identity();
  turned.linear() = rotation_from_vector(Vec3d(0.0, 0.0, 0.01));
  // Points of a unit sphere lie sqrt(2/3) from an axis, root mean square.
  EXPECT_NEAR(displacement_m(turned, Pose::Identity(), Vec3d::Zero(), 1.0), 0.01 * 0.81650, 1e-6);
}

TEST(Triples, OnlyAgreeingEdgesMakeAPose) {
  test::OwnedSurface source = test::random_cloud(40, 1.0, 3);
  test::OwnedSurface target = test::random_cloud(40, 1.0, 3);
  Pose truth = Pose::Identity();
  truth.linear() = rotation_from_vector(Vec3d(0.5, 1.0, -0.3));
  truth.translation() = Vec3d(1.0, 2.0, 3.0);
  test::move(*target, truth);
  std::vector<Keypoint> keypoints(40);
  for (std::int32_t i = 0; i < 40; ++i) keypoints[static_cast<std::size_t>(i)].point = i;
  std::vector<Correspondence> storage(40);
  Correspondences pairs{storage};
  // Half of the pairs are right, half point to the neighbour.
  for (std::int32_t i = 0; i < 40; ++i) pairs.push_back({i, i % 2 == 0 ? i : (i + 1) % 40, 0.0F});

  const PairView view{&*source, &*target, keypoints, keypoints};
  TripleCheck check;
  check.min_edge_m = 0.1;
  check.min_edge_ratio = 0.999;
  Rng rng(1);
  int drawn = 0;
  for (int i = 0; i < 2000; ++i) {
    Pose pose;
    if (!draw_pose(view, pairs, check, rng, pose)) continue;
    ++drawn;
    EXPECT_LT((pose.matrix() - truth.matrix()).cwiseAbs().maxCoeff(), 1e-3);
  }
  EXPECT_GT(drawn, 50);

  // Placed pairs are drawn alike.
  std::vector<PlacedPair> placed(pairs.size());
  place_pairs(view, pairs, placed);
  Rng one(2);
  Rng other(2);
  for (int i = 0; i < 2000; ++i) {
    Pose a = Pose::Identity();
    Pose b = Pose::Identity();
    ASSERT_EQ(draw_pose(view, pairs, check, one, a), draw_pose(view, placed, check, other, b));
    ASSERT_EQ(a.matrix(), b.matrix());
  }
}

class BoxIndex : public testing::Test {
 protected:
  BoxIndex()
      : model_(test::box_model(kSize_m, 0.005)),
        memory_([&](Arena& arena) { index_.reserve(arena, model_, params_, limits_, 33); }) {
    index_.build(model_, params_, 0.01);
  }

  static inline const Vec3d kSize_m = {0.4, 0.3, 0.2};
  Model model_;
  ModelIndexParams params_;
  Limits limits_;
  ModelIndex index_;
  test::ArenaMemory memory_;
};

TEST_F(BoxIndex, ViewsShowTheProjectedAreaOfTheBox) {
  for (const ViewTemplate& view : index_.templates.views()) {
    const Vec3d d = view.toward_camera.cast<double>().cwiseAbs();
    const double area_m2 = d.x() * kSize_m.y() * kSize_m.z() + d.y() * kSize_m.x() * kSize_m.z() +
                           d.z() * kSize_m.x() * kSize_m.y();
    // Of a face seen at less than 10 degrees nothing counts, and of one beside a nearer edge the
    // raster hides a strip.
    EXPECT_LT(static_cast<double>(view.visible_area_m2), 1.1 * area_m2);
    EXPECT_GT(static_cast<double>(view.visible_area_m2), 0.6 * area_m2);
    // What is visible lies on the camera's side.
    EXPECT_GT(view.middle.dot(view.toward_camera), 0.0F);
  }
  EXPECT_NEAR(index_.diameter_m, kSize_m.norm(), 1e-6);
  EXPECT_NEAR(index_.centre.norm(), 0.0, 1e-6);
}

TEST_F(BoxIndex, RatesTheTruePoseAboveAllOthers) {
  constexpr double kBelt_m = 1.1;
  const Pose truth = test::lying(kSize_m, kBelt_m, 0.05, -0.03, 0.4);
  test::BoxScene scene(320, 240, 280.0, kBelt_m);
  scene.add(truth, kSize_m);
  test::OwnedSurface object(4000, 0);
  const Intrinsics& k = scene.frame().intrinsics;
  std::vector<std::uint8_t> label(320 * 240, 0);
  for (int v = 0; v < 240; v += 1) {
    for (int u = 0; u < 320; u += 1) {
      const double z = scene.frame().depth.at(u, v) * scene.frame().metres_per_unit;
      if (z > kBelt_m - 0.01) continue;
      label[static_cast<std::size_t>(v * 320 + u)] = 1;
      if (u % 4 != 0 || v % 4 != 0) continue;
      const std::size_t i = object->size++;
      object->x[i] = static_cast<float>((u - k.cx) / k.fx * z);
      object->y[i] = static_cast<float>((v - k.cy) / k.fy * z);
      object->z[i] = static_cast<float>(z);
    }
  }
  SampleSet samples;
  SightImage sight;
  const test::ArenaMemory memory([&](Arena& arena) {
    samples.reserve(arena, 300);
    sight.reserve(arena, label.size());
  });
  samples.draw(*object, Rng(1));
  DepthView view;
  view.intrinsics = k;
  view.depth = scene.frame().depth;
  view.metres_per_unit = static_cast<float>(scene.frame().metres_per_unit);
  view.label = {label.data(), 320, 240};
  view.box = {0, 0, 320, 240};
  PoseScore::Scene measured;
  sight.build(view);
  measured.sight = &sight;
  measured.samples = &samples;
  const PoseScore score({&index_.samples, &index_.table, &index_.fine, &index_.field}, measured,
                        0.02F);
  const double best = score(truth, SIZE_MAX);
  EXPECT_GT(best, 1.8);  // 2 is perfect; points of the thinned model lie up to a spacing away
  Rng rng(4);
  for (int i = 0; i < 200; ++i) {
    Pose other = truth;
    const Vec3d turn(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1));
    other.linear() = rotation_from_vector(turn) * truth.linear();
    other.translation() += Vec3d(rng.uniform(-0.1, 0.1), rng.uniform(-0.1, 0.1), 0.05);
    EXPECT_LT(score(other, SIZE_MAX), best);
  }
}

}  // namespace
}  // namespace grapnel
