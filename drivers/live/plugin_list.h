#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace grapnel {

/// Starts a task on another thread; false when it can't.
using TaskLaunch = bool (*)(std::function<void()> task);

/// Body of a plug-in's `list`: writes the lines that `find` answers within 3 s on the thread that
/// `launch` takes, and returns their number; 0 when it takes longer.
[[nodiscard]] int list_in_time(std::function<std::vector<std::string>()> find, TaskLaunch launch,
                               char* lines, std::size_t bytes);

}  // namespace grapnel
