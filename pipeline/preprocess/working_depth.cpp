#include "pipeline/preprocess/working_depth.h"

namespace grapnel {

void WorkingDepth::reserve(Arena& arena, const Limits& limits) {
  const std::size_t pixels =
      static_cast<std::size_t>(limits.max_width) * static_cast<std::size_t>(limits.max_height);
  depth_memory = arena.take<std::uint16_t>(pixels);
  label_memory = arena.take<std::uint8_t>(pixels);
}

}  // namespace grapnel
