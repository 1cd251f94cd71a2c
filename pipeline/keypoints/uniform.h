#pragma once

#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct UniformParams {
  double cell_m = 0.0;      ///< edge of a cell; 0 = auto: cell_ratio spacings
  double cell_ratio = 4.0;  ///< × the spacing of the surface
  bool need_normal = true;  ///< skip points without normal
};

[[nodiscard]] FieldTable uniform_fields() noexcept;

/// One keypoint a cubic cell: the point nearest the cell's centre (PCL's UniformSampling). For
/// parts without features. When more come than fit, the cells grow until they fit and the set is
/// marked. Score 1.
class UniformDetector final : public KeypointDetector {
 public:
  explicit UniformDetector(const UniformParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  Status detect(const Surface& surface, KeypointSet& keypoints) noexcept override;

 private:
  struct Entry {
    std::uint64_t cell = 0;
    float off_centre = 0.0F;  ///< squared, in cells
    std::int32_t point = 0;
  };
  std::size_t choose(const Surface& surface, double cell_m) noexcept;

  UniformParams params_;
  std::span<Entry> entries_;
};

}  // namespace grapnel
