#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "base/file.h"
#include "drivers/replay/recording.h"
#include "drivers/synthetic/mesh.h"
#include "pipeline/model.h"
#include "tests/support/temp_folder.h"
#include "workbench/evaluate/suite.h"
#include "workbench/input.h"
#include "workbench/simulate/part_instance.h"
#include "workbench/simulate/qualification_scene.h"
#include "workbench/simulate/qualification_set.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

QualificationParams small_set(PartClass part) {
  QualificationParams params;
  params.part = part;
  params.instances = 2;
  params.positives = 3;
  params.either = 2;
  params.negatives = 6;
  return params;
}

TEST(PartInstance, SizesOfABoxAreFarEnoughApartForItsDeclaredSymmetry) {
  Rng rng(3);
  for (int i = 0; i < 50; ++i) {
    const PartInstance box = draw_instance(PartClass::Box, rng);
    EXPECT_GE(std::fabs(box.size_m.x() - box.size_m.y()), 0.12 * box.size_m.x());
    EXPECT_GE(std::fabs(box.size_m.y() - box.size_m.z()), 0.12 * box.size_m.y());
    EXPECT_NEAR((bounds_of(box.mesh).size_m() - box.size_m).norm(), 0.0, 1e-9);
  }
}

TEST(PartInstance, AMirroredMeshIsStillClosedWithOutwardNormals) {
  Rng rng(4);
  const PartInstance carton = draw_instance(PartClass::Carton, rng);
  const double volume_m3 = enclosed_volume_m3(carton.mesh);
  EXPECT_GT(volume_m3, 0.0);
  EXPECT_NEAR(enclosed_volume_m3(mirrored(carton.mesh)), volume_m3, 1e-12);
  EXPECT_NEAR(enclosed_volume_m3(scaled(carton.mesh, 1.1)), 1.331 * volume_m3, 1e-12);
}

TEST(QualificationScene, TouchingThingsDoNotOverlapAndAreNear) {
  Rng rng(5);
  const PartInstance box = draw_instance(PartClass::Box, rng);
  for (std::uint64_t i = 0; i < 20; ++i) {
    const QualificationScene drawn = draw_scene(box, SceneKind::Touching, Rng(i));
    ASSERT_EQ(drawn.scene.parts.size(), 2U);
    // Apart along some side of the first part's, by no more than 3 mm.
    const Pose& first = drawn.scene.parts[0].world_from_model;
    double widest_m = -1e9;
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        const Vec3d direction = sign * first.linear().col(axis);
        double own_m = -1e9;
        double other_m = 1e9;
        for (const Vec3d& v : drawn.scene.parts[0].mesh.vertices) {
          own_m = std::max(own_m, direction.dot(first * v));
        }
        for (const Vec3d& v : drawn.scene.parts[1].mesh.vertices) {
          other_m = std::min(other_m, direction.dot(drawn.scene.parts[1].world_from_model * v));
        }
        widest_m = std::max(widest_m, other_m - own_m);
      }
    }
    EXPECT_GE(widest_m, -1e-9);
    EXPECT_LE(widest_m, 0.003 + 1e-9);
  }
}

TEST(QualificationSet, HoldsWhatWasAskedForAndItsTruthFitsItsPictures) {
  const test::TempFolder folder;
  write_qualification_set(small_set(PartClass::Carton), folder.path() / "set", [] {});
  const Suite suite = load_suite(folder.path() / "set" / "suite.toml");
  ASSERT_EQ(suite.cases.size(), 11U);
  std::map<Expect, int> expected;
  for (const SuiteCase& one : suite.cases) {
    ++expected[one.expect];
    EXPECT_EQ(one.truth.has_value(), one.expect != Expect::Reject) << one.id;
    if (one.expect != Expect::Accept) continue;
    const Model model = load_model(one.source);
    const Input input = load_input(one.target, {});
    const DepthFrame& frame = input.frame();
    // Of the points that face the camera, nearly all lie on the measured surface; a part alone
    // hides only little of itself.
    int facing = 0;
    int met = 0;
    for (std::size_t i = 0; i < model.size(); i += 7) {
      const Vec3d p = *one.truth * Vec3d(model.x[i], model.y[i], model.z[i]);
      const Vec3d n = one.truth->linear() * Vec3d(model.nx[i], model.ny[i], model.nz[i]);
      if (-n.dot(p.normalized()) < 0.5) continue;
      const int u = static_cast<int>(
          std::floor(frame.intrinsics.fx * p.x() / p.z() + frame.intrinsics.cx + 0.5));
      const int v = static_cast<int>(
          std::floor(frame.intrinsics.fy * p.y() / p.z() + frame.intrinsics.cy + 0.5));
      const double measured_m = frame.depth.row(v)[u] * frame.metres_per_unit;
      if (measured_m == 0.0) continue;
      ++facing;
      // Five times the sensor's noise at 1.4 m.
      if (std::fabs(measured_m - p.z()) < 0.014) ++met;
    }
    EXPECT_GT(facing, 100) << one.id;
    EXPECT_GT(met, facing * 9 / 10) << one.id;
  }
  EXPECT_EQ(expected[Expect::Accept], 3);
  EXPECT_EQ(expected[Expect::Either], 2);
  EXPECT_EQ(expected[Expect::Reject], 6);
}

TEST(QualificationSet, IsTheSameForTheSameSeedAndSharesNoInstanceBetweenSplits) {
  const test::TempFolder folder;
  QualificationParams params = small_set(PartClass::Sack);
  params.positives = 1;
  params.either = 0;
  params.negatives = 1;
  const auto bytes = [&](const char* name) {
    write_qualification_set(params, folder.path() / name, [] {});
    return read_file(folder.path() / name / "suite.toml", 1 << 20);
  };
  const auto first = bytes("a");
  EXPECT_EQ(first, bytes("b"));
  params.split = Split::Lockbox;
  EXPECT_NE(first, bytes("c"));
  const Model a = load_model((folder.path() / "a/models/sack-tune-0.ply").string());
  const Model c = load_model((folder.path() / "c/models/sack-lockbox-0.ply").string());
  EXPECT_NE(a.x, c.x);
}

}  // namespace
}  // namespace grapnel
