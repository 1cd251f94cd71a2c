#pragma once

#include <string>
#include <vector>

#include "firmware_app/settings.h"
#include "pipeline/registrar.h"

namespace grapnel {

/// Memory the daemon takes at start beside a preset's own: the block of two presets, the frame
/// pool, the taught background, the threads' stacks.
[[nodiscard]] std::vector<MemoryItem> fixed_memory_plan(const Settings& settings);

/// Bytes of the background's images for these settings.
[[nodiscard]] std::size_t background_bytes(const Settings& settings);

/// Bytes of the images of one job on its way to a snapshot.
[[nodiscard]] std::size_t evidence_bytes(const Settings& settings);

[[nodiscard]] std::size_t total_bytes(const std::vector<MemoryItem>& items);

/// Checks grapnel.toml's presets and prints the memory plan on stdout, one line a problem on
/// stderr. Exit status: 0 all is well, 1 a problem was found.
[[nodiscard]] int run_check(const Settings& settings);

}  // namespace grapnel
