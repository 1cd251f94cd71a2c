#pragma once

#include <cstdint>
#include <functional>

namespace grapnel {

/// Runs a task on the one thread of this process that makes OpenNI's calls; tasks follow each
/// other. OpenNI 2 remembers the threads that called it and asks the system after them when they
/// have long ended, which crashes; so this one lives as long as the process. Its first task brings
/// the library up. False when no thread can be had.
[[nodiscard]] bool post_to_openni(std::function<void()> task);

/// Starts the library unless it is up, and waits for that. False when it fails or takes longer.
[[nodiscard]] bool bring_openni_up(std::int64_t limit_us);

/// True once the library is up.
[[nodiscard]] bool openni_is_up() noexcept;

}  // namespace grapnel
