#include "pipeline/refine/point_blocks.h"

#include <algorithm>
#include <array>

namespace grapnel {
namespace {

/// Four at once, as the compiler does not know that the arrays lie apart.
void take_every(std::size_t step, const float* from, std::size_t count, float* to) noexcept {
  std::size_t k = 0;
  for (; k + 4 <= count; k += 4, from += 4 * step) {
    const float a = from[0];
    const float b = from[step];
    const float c = from[2 * step];
    const float d = from[3 * step];
    to[k] = a;
    to[k + 1] = b;
    to[k + 2] = c;
    to[k + 3] = d;
  }
  for (; k < count; ++k, from += step) to[k] = *from;
}

}  // namespace

std::size_t take_block(const kernels::OrientedPlanes& points, std::size_t size, std::size_t first,
                       std::size_t step, kernels::PointBlock& block) noexcept {
  block.size = std::min((size - first + step - 1) / step, kernels::kBlockPoints);
  const std::array<const float*, 6> from = {points.x,  points.y,  points.z,
                                            points.nx, points.ny, points.nz};
  const std::array<float*, 6> to = {block.x, block.y, block.z, block.nx, block.ny, block.nz};
  for (std::size_t plane = 0; plane < from.size(); ++plane) {
    const float* const source = from[plane] + first;
    float* const out = to[plane];
    if (step == 1) {
      std::copy_n(source, block.size, out);
    } else {
      take_every(step, source, block.size, out);
    }
    std::fill(out + block.size, out + kernels::in_lanes(block.size), out[block.size - 1]);
  }
  return first + block.size * step;
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
