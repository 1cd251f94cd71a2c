#pragma once

#include <cstddef>

#include "pipeline/kernels/eigenvectors.h"

namespace grapnel::kernels {

/// Sums of vectors around points, one array each; and the points' unit normals, zero for none.
/// All hold `count` elements rounded up to a multiple of kEigenBlock, but the normals just `count`.
struct TangentSums {
  const float* count = nullptr;
  const float* first[3] = {};
  SymmetricPlanes products;
  const float* normal[3] = {};
};

/// How the vectors around each of `count` points spread in its tangent plane: the larger and the
/// smaller eigenvalue of their covariance there, and the unit direction of the larger, computed in
/// double and rounded. Zeros without normal. The outputs hold the count rounded up as above.
void tangent_spread(const TangentSums& sums, std::size_t count, float* larger, float* smaller,
                    const VectorPlanes& direction) noexcept;

}  // namespace grapnel::kernels
