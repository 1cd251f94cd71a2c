#pragma once

#include <cstddef>

#include "drivers/modbus/pose_format.h"
#include "drivers/modbus/register_image.h"
#include "hal/plc.h"

namespace grapnel {

/// The encoder's inverse, for clients: registers back into the structs of hal/plc.h. Lengths,
/// angles and ratios come back rounded as the map rounds them.
[[nodiscard]] PlcStatus decode_status(const RegisterImage& image) noexcept;

/// Everything of the result block but the objects.
[[nodiscard]] PlcResult decode_result_head(const RegisterImage& image) noexcept;

/// The object record that begins at `base`. A record whose pose reads kNoPose is not accepted,
/// whatever its DECISION says.
[[nodiscard]] PlcObject decode_object(const RegisterImage& image, std::size_t base) noexcept;

/// The pose registers of the record at `base`.
[[nodiscard]] PoseRegisters decode_pose_registers(const RegisterImage& image,
                                                  std::size_t base) noexcept;

/// A command as the 32 registers of the command block, from address 0.
void encode_command(const PlcCommand& command, RegisterImage& image) noexcept;

}  // namespace grapnel
