#pragma once

#include <cstddef>

namespace grapnel::kernels {

/// Entries xx, xy, xz, yy, yz, zz of symmetric 3×3 matrices, one array an entry.
struct SymmetricPlanes {
  const float* xx = nullptr;
  const float* xy = nullptr;
  const float* xz = nullptr;
  const float* yy = nullptr;
  const float* yz = nullptr;
  const float* zz = nullptr;
};

/// Eigenvalues of `count` matrices, ascending, computed in double as eigenvalues_symmetric3 and
/// rounded. Inputs and outputs hold `count` elements rounded up to a multiple of kEigenBlock.
inline constexpr std::size_t kEigenBlock = 4;
void eigenvalues(const SymmetricPlanes& matrices, std::size_t count, float* smallest, float* middle,
                 float* largest) noexcept;

}  // namespace grapnel::kernels
