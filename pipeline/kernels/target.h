#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace grapnel::kernels {

/// Name of the SIMD target the kernels run on ("AVX2", …).
[[nodiscard]] const char* target_name() noexcept;

/// Names of the targets that this build holds and this machine can run, best first.
[[nodiscard]] std::vector<std::string> target_names();

/// Runs every kernel on the named target from now on; "" = the best one. False, and no change, when
/// this machine or build lacks it. Not while a kernel runs.
[[nodiscard]] bool force_target(std::string_view name) noexcept;

}  // namespace grapnel::kernels
