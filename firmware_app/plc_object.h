#pragma once

#include <cstdint>

#include "firmware_app/job.h"
#include "hal/plc.h"
#include "pipeline/report.h"

namespace grapnel {

/// One report as the field bus shows it: the grasp of the model found, in the robot's frame where
/// the camera is calibrated and the command did not ask for the camera's. `extra_quality` are
/// QUALITY bits that the report does not know of.
[[nodiscard]] PlcObject to_plc_object(const RegistrationReport& report, const JobProfile& profile,
                                      bool camera_frame, std::uint16_t extra_quality) noexcept;

/// REASONS register: bit n stands for code 1000 + n.
[[nodiscard]] std::uint32_t reason_bits(const RegistrationReport& report) noexcept;

}  // namespace grapnel
