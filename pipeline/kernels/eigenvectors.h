#pragma once

#include <cstddef>

#include "pipeline/kernels/eigenvalues.h"

namespace grapnel::kernels {

/// Coordinates of vectors, one array each.
struct VectorPlanes {
  float* x = nullptr;
  float* y = nullptr;
  float* z = nullptr;
};

/// Elements that are worked on together; inputs and outputs hold the count rounded up to it.
inline constexpr std::size_t kVectorBlock = 16;
/// An eigenvalue nearer than this part of the largest is too near: see below.
inline constexpr float kLeastGap = 0.01F;

/// Unit eigenvectors of the smallest eigenvalue of `count` covariances, each by itself, in closed
/// form and single precision: right to about 1e-5 rad. Zero where the next eigenvalue is too near,
/// or the trace is not above 0: the caller takes its slow way there.
void smallest_eigenvectors(const SymmetricPlanes& matrices, std::size_t count,
                           const VectorPlanes& out) noexcept;

/// The same of the largest eigenvalue, and the roots of these: how far the covariance's points
/// spread. Right to 1e-4 of the spread where eigenvalues are near.
void largest_eigenvectors(const SymmetricPlanes& matrices, std::size_t count, float* root,
                          const VectorPlanes& out) noexcept;

}  // namespace grapnel::kernels
