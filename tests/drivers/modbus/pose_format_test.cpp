#include "drivers/modbus/pose_format.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/math.h"
#include "base/rng.h"

namespace grapnel {
namespace {

constexpr double kDeg = math::kPi / 180.0;
// The bound asked of every format: 0.002 degrees. Three angles rounded to 0.001° can turn the frame
// by 1.5 × 0.001° at the most.
constexpr double kRoundTripRad = 0.002 * kDeg;

Mat3d about(const Vec3d& axis, double angle_deg) {
  return Eigen::AngleAxisd(angle_deg * kDeg, axis).toRotationMatrix();
}

Pose turned(const Mat3d& rotation) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation;
  return pose;
}

// Uniform over all rotations (Shoemake 1992).
Mat3d random_rotation(Rng& rng) {
  Eigen::Quaterniond q(rng.normal(), rng.normal(), rng.normal(), rng.normal());
  return q.normalized().toRotationMatrix();
}

double angle_between(const Mat3d& a, const Mat3d& b) {
  return 2.0 * std::asin(std::min(1.0, (a - b).norm() / (2.0 * std::sqrt(2.0))));
}

const Vec3d kX = Vec3d::UnitX();
const Vec3d kY = Vec3d::UnitY();
const Vec3d kZ = Vec3d::UnitZ();

class EveryFullFormat : public testing::TestWithParam<PoseFormat> {};

TEST_P(EveryFullFormat, CarriesAHundredThousandRotationsThereAndBack) {
  Rng rng(20);
  for (int i = 0; i < 100'000; ++i) {
    const Mat3d rotation = random_rotation(rng);
    const Result<Pose> back = decode_pose(encode_pose(turned(rotation), GetParam()), GetParam());
    ASSERT_TRUE(back.ok());
    ASSERT_LE(angle_between(back.value().linear(), rotation), kRoundTripRad) << i;
  }
}

TEST_P(EveryFullFormat, CarriesRotationsCloseToEveryQuarterTurn) {
  Rng rng(21);
  const double offsets_deg[] = {0.0, 1e-7, 3e-5, 1e-4, 1e-3, 0.01};
  for (int i = 0; i < 5000; ++i) {
    Mat3d rotation = Mat3d::Identity();
    for (const Vec3d& axis : {kZ, kY, kX, kZ}) {
      const double offset = offsets_deg[rng.below(6)] * (rng.below(2) == 0 ? 1.0 : -1.0);
      rotation = rotation * about(axis, 90.0 * rng.below(4) + offset);
    }
    const Result<Pose> back = decode_pose(encode_pose(turned(rotation), GetParam()), GetParam());
    ASSERT_TRUE(back.ok());
    ASSERT_LE(angle_between(back.value().linear(), rotation), kRoundTripRad) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, EveryFullFormat,
                         testing::Values(PoseFormat::IntrinsicZyx, PoseFormat::FixedXyz,
                                         PoseFormat::Quaternion, PoseFormat::RotationVector,
                                         PoseFormat::IntrinsicXyz, PoseFormat::IntrinsicZyz));

TEST(PoseFormat, AnglesAreThoseOfTheirDefinition) {
  const Mat3d abc = about(kZ, 30.0) * about(kY, -40.0) * about(kX, 50.0);
  const PoseRegisters kuka = encode_pose(turned(abc), PoseFormat::IntrinsicZyx);
  EXPECT_EQ(kuka, (PoseRegisters{0, 0, 0, 30000, -40000, 50000, 0}));
  const Mat3d xyz = about(kX, 10.0) * about(kY, 20.0) * about(kZ, -170.0);
  EXPECT_EQ(encode_pose(turned(xyz), PoseFormat::IntrinsicXyz),
            (PoseRegisters{0, 0, 0, 10000, 20000, -170000, 0}));
  const Mat3d zyz = about(kZ, -120.0) * about(kY, 35.0) * about(kZ, 100.0);
  EXPECT_EQ(encode_pose(turned(zyz), PoseFormat::IntrinsicZyz),
            (PoseRegisters{0, 0, 0, -120000, 35000, 100000, 0}));
  EXPECT_EQ(encode_pose(turned(about(kZ, 77.125)), PoseFormat::Planar),
            (PoseRegisters{0, 0, 0, 77125, 0, 0, 0}));
}

TEST(PoseFormat, TwoIsOneReversed) {
  Rng rng(22);
  for (int i = 0; i < 10'000; ++i) {
    const Pose pose = turned(random_rotation(rng));
    const PoseRegisters one = encode_pose(pose, PoseFormat::IntrinsicZyx);
    const PoseRegisters two = encode_pose(pose, PoseFormat::FixedXyz);
    ASSERT_EQ(one[3], two[5]);
    ASSERT_EQ(one[4], two[4]);
    ASSERT_EQ(one[5], two[3]);
  }
}

TEST(PoseFormat, QuaternionAndRotationVectorAgreeWithEigen) {
  Rng rng(23);
  for (int i = 0; i < 1000; ++i) {
    const Mat3d rotation = random_rotation(rng);
    Eigen::Quaterniond q(rotation);
    if (q.w() < 0.0) q.coeffs() = -q.coeffs();
    const PoseRegisters quaternion = encode_pose(turned(rotation), PoseFormat::Quaternion);
    EXPECT_NEAR(quaternion[3], q.w() * 1e6, 0.51);
    EXPECT_NEAR(quaternion[4], q.x() * 1e6, 0.51);
    EXPECT_NEAR(quaternion[6], q.z() * 1e6, 0.51);
    const Eigen::AngleAxisd angle_axis(rotation);
    const Vec3d vector = angle_axis.angle() * angle_axis.axis();
    const PoseRegisters rotvec = encode_pose(turned(rotation), PoseFormat::RotationVector);
    EXPECT_NEAR(rotvec[3], vector.x() * 1e6, 0.51);
    EXPECT_NEAR(rotvec[4], vector.y() * 1e6, 0.51);
    EXPECT_NEAR(rotvec[5], vector.z() * 1e6, 0.51);
  }
}

TEST(PoseFormat, TheLastAngleIsZeroAtTheSingularity) {
  for (const double c_deg : {-130.0, 0.0, 25.0}) {
    const Mat3d up = about(kZ, 40.0) * about(kY, 90.0) * about(kX, c_deg);
    EXPECT_EQ(encode_pose(turned(up), PoseFormat::IntrinsicZyx)[5], 0);
    EXPECT_EQ(encode_pose(turned(up), PoseFormat::FixedXyz)[3], 0);
    const Mat3d side = about(kX, 40.0) * about(kY, -90.0) * about(kZ, c_deg);
    EXPECT_EQ(encode_pose(turned(side), PoseFormat::IntrinsicXyz)[5], 0);
    const Mat3d flat = about(kZ, 40.0) * about(kZ, c_deg);
    const PoseRegisters zyz = encode_pose(turned(flat), PoseFormat::IntrinsicZyz);
    EXPECT_EQ(zyz[4], 0);
    EXPECT_EQ(zyz[5], 0);
  }
}

TEST(PoseFormat, HalfTurnsHaveOneSign) {
  for (const Vec3d& axis : {kX, kY, kZ, Vec3d(1, 1, 0).normalized(), Vec3d(0, 1, -1).normalized(),
                            Vec3d(-1, 2, 3).normalized()}) {
    PoseRegisters first{};
    for (const double wobble_deg : {-1e-9, 0.0, 1e-9}) {
      const Mat3d rotation = about(axis, 180.0 + wobble_deg);
      for (const PoseFormat format : {PoseFormat::Quaternion, PoseFormat::RotationVector}) {
        const PoseRegisters registers = encode_pose(turned(rotation), format);
        const bool quaternion = format == PoseFormat::Quaternion;
        if (quaternion) {
          EXPECT_EQ(registers[3], 0);
        }
        int i = quaternion ? 4 : 3;
        while (registers[static_cast<std::size_t>(i)] == 0) ++i;
        EXPECT_GT(registers[static_cast<std::size_t>(i)], 0) << axis.transpose();
        if (!quaternion) continue;
        if (wobble_deg < 0.0) first = registers;
        EXPECT_EQ(registers, first) << axis.transpose();
      }
    }
  }
}

TEST(PoseFormat, AHalfTurnReadsPlus180) {
  for (const double wobble_deg : {-1e-9, 0.0, 1e-9}) {
    const PoseRegisters registers =
        encode_pose(turned(about(kZ, 180.0 + wobble_deg)), PoseFormat::IntrinsicZyx);
    EXPECT_EQ(registers[3], 180000);
  }
}

TEST(PoseFormat, PositionsAreMicrometresAndSaturateBesideTheSentinel) {
  Pose pose = Pose::Identity();
  pose.translation() = Vec3d(0.1234564, -2147.0, 1e9);
  const PoseRegisters registers = encode_pose(pose, PoseFormat::IntrinsicZyx);
  EXPECT_EQ(registers[0], 123456);
  EXPECT_EQ(registers[1], -2147000000);
  EXPECT_EQ(registers[2], 2147483647);
  pose.translation().z() = -1e9;
  EXPECT_EQ(encode_pose(pose, PoseFormat::Quaternion)[2], -2147483647);
}

TEST(PoseFormat, APoseThatIsNotFiniteIsNoPose) {
  Pose pose = Pose::Identity();
  pose.translation().y() = std::nan("");
  for (const std::int32_t value : encode_pose(pose, PoseFormat::IntrinsicZyx)) {
    EXPECT_EQ(value, kNoPose);
  }
  EXPECT_FALSE(decode_pose(no_pose(), PoseFormat::IntrinsicZyx).ok());
}

TEST(PoseFormat, DecodingRefusesAQuaternionThatIsNone) {
  EXPECT_FALSE(decode_pose({0, 0, 0, 0, 0, 0, 0}, PoseFormat::Quaternion).ok());
  EXPECT_FALSE(decode_pose({0, 0, 0, 980000, 0, 0, 0}, PoseFormat::Quaternion).ok());
  EXPECT_TRUE(decode_pose({0, 0, 0, 1000000, 0, 0, 0}, PoseFormat::Quaternion).ok());
}

TEST(PoseFormat, FloatsAreTheSameNumbersInMillimetresAndDegrees) {
  const auto reals = pose_reals({123456, -1, 0, 45001, kNoPose, 0, 0}, PoseFormat::IntrinsicZyx);
  EXPECT_EQ(reals[0], 123.456f);
  EXPECT_EQ(reals[1], -0.001f);
  EXPECT_EQ(reals[3], 45.001f);
  EXPECT_TRUE(std::isnan(reals[4]));
  EXPECT_EQ(pose_reals({0, 0, 0, 500000, 0, 0, 0}, PoseFormat::Quaternion)[3], 0.5f);
}

}  // namespace
}  // namespace grapnel
