#include <gtest/gtest.h>

#include "base/input_error.h"
#include "base/math.h"
#include "base/rng.h"
#include "pipeline/model.h"

namespace grapnel {
namespace {

constexpr double kTolerance_rad = 1e-9;

Pose random_pose(Rng& rng) {
  Pose pose = Pose::Identity();
  pose.linear() =
      rotation_from_vector(Vec3d(rng.uniform(-2, 2), rng.uniform(-2, 2), rng.uniform(-2, 2)));
  pose.translation() = Vec3d(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1));
  return pose;
}

Pose turned(const Pose& pose, const Vec3d& axis, double angle_rad) {
  Pose result = pose;
  result.linear() = pose.linear() * rotation_from_vector(axis * angle_rad);
  return result;
}

TEST(Symmetry, UndoesEveryTurnOfItsOwnGroup) {
  Rng rng(1);
  struct Case {
    Symmetry symmetry;
    Vec3d axis;
    double angle_rad;
  };
  const Case cases[] = {
      {Symmetry::X180, Vec3d::UnitX(), math::kPi},     {Symmetry::Y180, Vec3d::UnitY(), math::kPi},
      {Symmetry::Z180, Vec3d::UnitZ(), math::kPi},     {Symmetry::Box, Vec3d::UnitX(), math::kPi},
      {Symmetry::Box, Vec3d::UnitY(), math::kPi},      {Symmetry::Box, Vec3d::UnitZ(), math::kPi},
      {Symmetry::AxisX, Vec3d::UnitX(), 1.234},        {Symmetry::AxisY, Vec3d::UnitY(), -2.5},
      {Symmetry::AxisZ, Vec3d::UnitZ(), 0.7},          {Symmetry::AxisZFlip, Vec3d::UnitZ(), 2.9},
      {Symmetry::AxisZFlip, Vec3d::UnitY(), math::kPi}};
  for (const Case& c : cases) {
    const Pose reference = random_pose(rng);
    const Pose found = turned(reference, c.axis, c.angle_rad);
    EXPECT_NEAR(rotation_angle_rad(nearest_equivalent(found, reference, c.symmetry), reference),
                0.0, kTolerance_rad)
        << symmetry_name(c.symmetry);
    EXPECT_TRUE(equivalent(found, reference, c.symmetry, 1e-9, 1e-6));
    EXPECT_FALSE(equivalent(found, reference, Symmetry::None, 1e-9, 0.1));
  }
}

TEST(Symmetry, KeepsApartWhatIsOutsideOfTheGroup) {
  Rng rng(2);
  const Pose reference = random_pose(rng);
  EXPECT_FALSE(equivalent(turned(reference, Vec3d::UnitX(), math::kPi), reference, Symmetry::Z180,
                          1e-9, 0.5));
  EXPECT_FALSE(equivalent(turned(reference, Vec3d::UnitX(), math::kPi), reference, Symmetry::AxisZ,
                          1e-9, 0.5));
  EXPECT_FALSE(equivalent(turned(reference, Vec3d::UnitZ(), 0.5 * math::kPi), reference,
                          Symmetry::Box, 1e-9, 0.5));
}

TEST(Symmetry, OfTheEquivalentPosesTakesTheNearest) {
  Rng rng(3);
  for (int i = 0; i < 20; ++i) {
    const Pose reference = random_pose(rng);
    const Pose found = random_pose(rng);
    const double nearest =
        rotation_angle_rad(nearest_equivalent(found, reference, Symmetry::AxisZ), reference);
    for (int step = 0; step < 360; ++step) {
      const Pose other = turned(found, Vec3d::UnitZ(), step * math::kPi / 180.0);
      EXPECT_GE(rotation_angle_rad(other, reference), nearest - kTolerance_rad);
    }
  }
}

TEST(Symmetry, NamesRoundTripAndUnknownOnesAreRefused) {
  for (const char* name :
       {"none", "x180", "y180", "z180", "box", "axis_x", "axis_y", "axis_z", "axis_z_flip"}) {
    EXPECT_STREQ(symmetry_name(symmetry_from_name(name)), name);
  }
  EXPECT_THROW(static_cast<void>(symmetry_from_name("axis")), InputError);
}

}  // namespace
}  // namespace grapnel
