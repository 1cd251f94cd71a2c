#include "pipeline/features.h"

namespace grapnel {

void FeatureMatrix::reserve(Arena& arena, std::size_t max_rows, std::size_t dimension_) {
  dimension = dimension_;
  stride = padded(dimension_);
  values = arena.take<float>(max_rows * stride);
}

}  // namespace grapnel
