#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace grapnel {

/// Body of a plug-in's `list`: writes the lines that `find` answers within 3 s, on a thread of its
/// own, and returns their number; 0 when it takes longer.
[[nodiscard]] int list_in_time(std::function<std::vector<std::string>()> find, char* lines,
                               std::size_t bytes);

}  // namespace grapnel
