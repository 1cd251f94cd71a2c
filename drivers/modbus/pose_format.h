#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "base/error.h"
#include "base/geometry.h"

namespace grapnel {

/// How a rotation is given in registers; the number is POSE_FORMAT.
enum class PoseFormat : std::uint16_t {
  IntrinsicZyx = 1,    ///< A B C: Rz(A) Ry(B) Rx(C)
  FixedXyz = 2,        ///< W P R: Rz(R) Ry(P) Rx(W), format 1 reversed
  Quaternion = 3,      ///< w x y z, w ≥ 0
  RotationVector = 4,  ///< axis × angle, angle ≤ π
  IntrinsicXyz = 5,    ///< Rx(R1) Ry(R2) Rz(R3)
  IntrinsicZyz = 6,    ///< Rz(R1) Ry(R2) Rz(R3), R2 in 0…180°
  Planar = 7,          ///< yaw about Z only
};

/// What every pose register reads when there is no pose to act on.
inline constexpr std::int32_t kNoPose = std::numeric_limits<std::int32_t>::min();

/// X Y Z in micrometres, then R1…R4 in 0.001° or 10⁻⁶ (quaternion part, radian); unused parts 0.
using PoseRegisters = std::array<std::int32_t, 7>;

/// All seven registers at kNoPose.
[[nodiscard]] constexpr PoseRegisters no_pose() noexcept {
  PoseRegisters registers{};
  registers.fill(kNoPose);
  return registers;
}

/// True for 1…7.
[[nodiscard]] constexpr bool is_pose_format(std::uint16_t number) noexcept {
  return number >= 1 && number <= 7;
}

/// Numbers saturate one short of kNoPose; a pose that is not finite gives no_pose(). Angles lie in
/// (-180°, 180°]. Within 10⁻⁶ rad of a singularity the last angle (the first of format 2) is 0. The
/// quaternion has w ≥ 0, the rotation vector an angle ≤ π; where the sign is free the first part
/// that is not 0 is positive. Format 7 keeps the heading of the X axis.
[[nodiscard]] PoseRegisters encode_pose(const Pose& pose, PoseFormat format) noexcept;

/// BadParameter when a part is kNoPose, or a quaternion's length is off 1 by more than 1 %.
[[nodiscard]] Result<Pose> decode_pose(const PoseRegisters& registers, PoseFormat format) noexcept;

/// The same numbers for the float mirror: mm, then degrees, radians or quaternion parts; NaN where
/// the register is kNoPose.
[[nodiscard]] std::array<float, 7> pose_reals(const PoseRegisters& registers,
                                              PoseFormat format) noexcept;

/// Value of one unit of R1…R4: 0.001 (degrees) or 10⁻⁶.
[[nodiscard]] double rotation_scale(PoseFormat format) noexcept;

}  // namespace grapnel
