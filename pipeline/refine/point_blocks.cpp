#include "pipeline/refine/point_blocks.h"

#include <algorithm>

namespace grapnel {

std::size_t take_block(const Surface& surface, std::size_t first, std::size_t step,
                       kernels::PointBlock& block) noexcept {
  std::size_t k = 0;
  std::size_t i = first;
  if (step == 1) {
    k = std::min(surface.size - first, kernels::kBlockPoints);
    i += k;
    std::copy_n(surface.x.data() + first, k, block.x);
    std::copy_n(surface.y.data() + first, k, block.y);
    std::copy_n(surface.z.data() + first, k, block.z);
    std::copy_n(surface.nx.data() + first, k, block.nx);
    std::copy_n(surface.ny.data() + first, k, block.ny);
    std::copy_n(surface.nz.data() + first, k, block.nz);
  }
  for (; i < surface.size && k < kernels::kBlockPoints; i += step, ++k) {
    block.x[k] = surface.x[i];
    block.y[k] = surface.y[i];
    block.z[k] = surface.z[i];
    block.nx[k] = surface.nx[i];
    block.ny[k] = surface.ny[i];
    block.nz[k] = surface.nz[i];
  }
  block.size = k;
  for (; k < kernels::in_lanes(block.size); ++k) {
    for (float* plane : {block.x, block.y, block.z, block.nx, block.ny, block.nz}) {
      plane[k] = plane[block.size - 1];
    }
  }
  return i;
}

PlanePairs add_plane_pairs(const kernels::PointBlock& block, const kernels::OrientedPlanes& fixed,
                           const kernels::PairGate& gate, NormalEquations& equations) noexcept {
  kernels::PlaneSums parts{};
  kernels::add_plane_pairs(block, fixed, gate, parts);
  double upper[21];
  double gradient[6];
  for (int k = 0; k < 21; ++k) upper[k] = sum_of(parts.sum[k]);
  for (int a = 0; a < 6; ++a) gradient[a] = sum_of(parts.sum[21 + a]);
  equations.add_sums(upper, gradient, sum_of(parts.sum[27]), sum_of(parts.sum[28]));
  return {sum_of(parts.sum[29]), static_cast<std::uint32_t>(sum_of(parts.sum[30]))};
}

}  // namespace grapnel
