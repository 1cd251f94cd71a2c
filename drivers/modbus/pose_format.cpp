#include "drivers/modbus/pose_format.h"

#include <cmath>
#include <cstddef>

#include "base/math.h"

namespace grapnel {
namespace {

constexpr double kMicrometresPerMetre = 1e6;
constexpr double kMillidegreesPerRadian = 180000.0 / math::kPi;
constexpr double kMicro = 1e6;
constexpr std::int32_t kHalfTurnMdeg = 180000;
constexpr std::int32_t kHalfTurnMicroRad = 3141593;

// Leaving the last angle out within this distance of a singularity turns the frame by as much:
// 0.00006°, far below the last digit.
constexpr double kSingular = 1e-6;

std::int32_t saturate(double value) noexcept {
  constexpr double kLimit = std::numeric_limits<std::int32_t>::max();
  if (value >= kLimit) return std::numeric_limits<std::int32_t>::max();
  if (value <= -kLimit) return -std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::nearbyint(value));
}

std::int32_t millidegrees(double angle_rad) noexcept {
  const std::int32_t value = saturate(angle_rad * kMillidegreesPerRadian);
  return value == -kHalfTurnMdeg ? kHalfTurnMdeg : value;
}

struct Angles {
  double first = 0.0;
  double second = 0.0;
  double third = 0.0;
};

// R = Rz(first) Ry(second) Rx(third).
Angles angles_zyx(const Mat3d& r) noexcept {
  const double cosine = std::sqrt(r(0, 0) * r(0, 0) + r(1, 0) * r(1, 0));
  const double second = math::atan2(-r(2, 0), cosine);
  if (cosine < kSingular) return {math::atan2(-r(0, 1), r(1, 1)), second, 0.0};
  return {math::atan2(r(1, 0), r(0, 0)), second, math::atan2(r(2, 1), r(2, 2))};
}

// R = Rx(first) Ry(second) Rz(third).
Angles angles_xyz(const Mat3d& r) noexcept {
  const double cosine = std::sqrt(r(0, 0) * r(0, 0) + r(0, 1) * r(0, 1));
  const double second = math::atan2(r(0, 2), cosine);
  if (cosine < kSingular) return {math::atan2(r(2, 1), r(1, 1)), second, 0.0};
  return {math::atan2(-r(1, 2), r(2, 2)), second, math::atan2(-r(0, 1), r(0, 0))};
}

// R = Rz(first) Ry(second) Rz(third).
Angles angles_zyz(const Mat3d& r) noexcept {
  const double sine = std::sqrt(r(0, 2) * r(0, 2) + r(1, 2) * r(1, 2));
  const double second = math::atan2(sine, r(2, 2));
  if (sine < kSingular) return {math::atan2(-r(0, 1), r(1, 1)), second, 0.0};
  return {math::atan2(r(1, 2), r(0, 2)), second, math::atan2(r(2, 1), -r(2, 0))};
}

// Turns the sign so that the first part that is not 0 is positive.
void fix_sign(std::int32_t* parts, int count) noexcept {
  int i = 0;
  while (i < count && parts[i] == 0) ++i;
  if (i == count || parts[i] > 0) return;
  for (i = 0; i < count; ++i) parts[i] = -parts[i];
}

void encode_quaternion(const Mat3d& rotation, PoseRegisters& registers) noexcept {
  const Eigen::Quaterniond q(rotation);
  const double sign = q.w() < 0.0 ? -kMicro : kMicro;
  registers[3] = saturate(sign * q.w());
  registers[4] = saturate(sign * q.x());
  registers[5] = saturate(sign * q.y());
  registers[6] = saturate(sign * q.z());
  if (registers[3] == 0) fix_sign(&registers[4], 3);
}

void encode_rotation_vector(const Mat3d& rotation, PoseRegisters& registers) noexcept {
  const Vec3d vector_rad = vector_from_rotation(rotation);
  for (int i = 0; i < 3; ++i) {
    registers[static_cast<std::size_t>(3 + i)] = saturate(kMicro * vector_rad[i]);
  }
  if (saturate(kMicro * vector_rad.norm()) >= kHalfTurnMicroRad) fix_sign(&registers[3], 3);
}

Mat3d about(const Vec3d& axis, std::int32_t angle_mdeg) noexcept {
  return rotation_from_vector(axis * (static_cast<double>(angle_mdeg) / kMillidegreesPerRadian));
}

Result<Mat3d> decode_quaternion(const PoseRegisters& r) noexcept {
  const Eigen::Quaterniond q(r[3] / kMicro, r[4] / kMicro, r[5] / kMicro, r[6] / kMicro);
  const double norm = q.norm();
  if (!(std::fabs(norm - 1.0) <= 0.01)) return Error{Code::BadParameter, Stage::FieldBus, 0};
  return Mat3d(q.normalized().toRotationMatrix());
}

Result<Mat3d> decode_rotation(const PoseRegisters& r, PoseFormat format) noexcept {
  const Vec3d x = Vec3d::UnitX();
  const Vec3d y = Vec3d::UnitY();
  const Vec3d z = Vec3d::UnitZ();
  switch (format) {
    case PoseFormat::IntrinsicZyx:
      return Mat3d(about(z, r[3]) * about(y, r[4]) * about(x, r[5]));
    case PoseFormat::FixedXyz:
      return Mat3d(about(z, r[5]) * about(y, r[4]) * about(x, r[3]));
    case PoseFormat::Quaternion:
      return decode_quaternion(r);
    case PoseFormat::RotationVector:
      return rotation_from_vector(Vec3d(r[3], r[4], r[5]) / kMicro);
    case PoseFormat::IntrinsicXyz:
      return Mat3d(about(x, r[3]) * about(y, r[4]) * about(z, r[5]));
    case PoseFormat::IntrinsicZyz:
      return Mat3d(about(z, r[3]) * about(y, r[4]) * about(z, r[5]));
    case PoseFormat::Planar:
      return about(z, r[3]);
  }
  return Error{Code::BadParameter, Stage::FieldBus, 0};
}

}  // namespace

PoseRegisters encode_pose(const Pose& pose, PoseFormat format) noexcept {
  if (!pose.matrix().allFinite()) return no_pose();
  PoseRegisters registers{};
  for (int i = 0; i < 3; ++i) {
    registers[static_cast<std::size_t>(i)] = saturate(kMicrometresPerMetre * pose.translation()[i]);
  }
  const Mat3d rotation = pose.linear();
  Angles angles;
  switch (format) {
    case PoseFormat::Quaternion:
      encode_quaternion(rotation, registers);
      return registers;
    case PoseFormat::RotationVector:
      encode_rotation_vector(rotation, registers);
      return registers;
    case PoseFormat::IntrinsicZyx:
      angles = angles_zyx(rotation);
      break;
    case PoseFormat::FixedXyz:
      angles = angles_zyx(rotation);
      angles = {angles.third, angles.second, angles.first};
      break;
    case PoseFormat::IntrinsicXyz:
      angles = angles_xyz(rotation);
      break;
    case PoseFormat::IntrinsicZyz:
      angles = angles_zyz(rotation);
      break;
    case PoseFormat::Planar:
      angles = {angles_zyx(rotation).first, 0.0, 0.0};
      break;
  }
  registers[3] = millidegrees(angles.first);
  registers[4] = millidegrees(angles.second);
  registers[5] = millidegrees(angles.third);
  return registers;
}

Result<Pose> decode_pose(const PoseRegisters& registers, PoseFormat format) noexcept {
  for (const std::int32_t value : registers) {
    if (value == kNoPose) return Error{Code::BadParameter, Stage::FieldBus, 0};
  }
  const Result<Mat3d> rotation = decode_rotation(registers, format);
  if (!rotation) return rotation.error();
  Pose pose = Pose::Identity();
  pose.linear() = rotation.value();
  pose.translation() = Vec3d(registers[0], registers[1], registers[2]) / kMicrometresPerMetre;
  return pose;
}

double rotation_scale(PoseFormat format) noexcept {
  const bool unitless = format == PoseFormat::Quaternion || format == PoseFormat::RotationVector;
  return unitless ? 1e-6 : 1e-3;
}

std::array<float, 7> pose_reals(const PoseRegisters& registers, PoseFormat format) noexcept {
  // Dividing gives the real number nearest to the decimal one; multiplying by 0.001 does not.
  const double per_unit = std::nearbyint(1.0 / rotation_scale(format));
  std::array<float, 7> reals{};
  for (std::size_t i = 0; i < reals.size(); ++i) {
    const double divisor = i < 3 ? 1000.0 : per_unit;
    reals[i] = registers[i] == kNoPose ? std::numeric_limits<float>::quiet_NaN()
                                       : static_cast<float>(registers[i] / divisor);
  }
  return reals;
}

}  // namespace grapnel
