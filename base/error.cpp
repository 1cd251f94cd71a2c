#include "base/error.h"

#include <array>
#include <cstddef>

namespace grapnel {

const char* stage_name(Stage stage) noexcept {
  static constexpr std::array<const char*, static_cast<std::size_t>(Stage::kCount)> kNames = {
      "none",     "capture", "organize",  "median",      "outliers", "background", "segment",
      "decimate", "normals", "keypoints", "descriptors", "match",    "reject",     "coarse",
      "refine",   "judge",   "publish",   "config",      "model",    "field_bus",  "recording"};
  const auto index = static_cast<std::size_t>(stage);
  return index < kNames.size() ? kNames[index] : "unknown";
}

}  // namespace grapnel
