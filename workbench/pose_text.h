#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "base/geometry.h"

namespace grapnel {

/// A pose from 16 numbers, row-major; nothing when they are no rigid motion. Rounding in the
/// rotation (up to 1e-3) is taken out.
[[nodiscard]] std::optional<Pose> pose_from_numbers(std::span<const double> row_major);

/// A file with 16 numbers, row-major, between white space or commas. Throws InputError.
[[nodiscard]] Pose load_pose(const std::filesystem::path& file);

/// Four lines of four numbers.
[[nodiscard]] std::string pose_text(const Pose& pose);

}  // namespace grapnel
