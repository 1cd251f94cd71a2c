#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "pipeline/kernels/reference.h"

namespace grapnel::kernels::reference {
namespace {

constexpr float kMissing = 1e14F;

float squared(float x, float y, float z) { return (x * x + y * y) + z * z; }

/// Cell of a direction's cosine to the first axis, folded into -90…90 degrees.
std::size_t cell_of(float cosine) {
  constexpr std::array<float, 8> kEdges = {0.98480775F, 0.93969262F, 0.86602540F, 0.76604444F,
                                           0.64278761F, 0.5F,        0.34202014F, 0.17364818F};
  if (cosine <= -1.0F) return 9;
  const float size = std::fabs(cosine);
  const auto below = static_cast<std::size_t>(
      std::count_if(kEdges.begin(), kEdges.end(), [&](float edge) { return size <= edge; }));
  return cosine > 0.0F ? below + 9 : 8 - below;
}

}  // namespace

void ranges(const RangePlanes& row, std::ptrdiff_t count, float* range, float* nearest,
            float* farthest) noexcept {
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    range[i] = 0.0F;
    if (!(row.x[i] < kMissing)) continue;
    range[i] = std::sqrt(squared(row.x[i], row.y[i], row.z[i]));
    *nearest = std::min(*nearest, range[i]);
    *farthest = std::max(*farthest, range[i]);
  }
}

void halve_row(const RangeRow& from, std::ptrdiff_t stride, std::ptrdiff_t count,
               const MutableRangeRow& to) noexcept {
  const auto valid = [&](std::ptrdiff_t i) { return from.x[i] < kMissing; };
  const auto far = [&](std::ptrdiff_t i) { return from.x[i] > 1.5e15F; };
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    std::ptrdiff_t best = 2 * i;
    for (const std::ptrdiff_t other : {2 * i + stride, 2 * i + 1, 2 * i + 1 + stride}) {
      if (!valid(other) && !far(other)) continue;
      const bool nearer = valid(other) && from.range[other] <= from.range[best];
      if (nearer || !valid(best)) best = other;
    }
    to.x[i] = from.x[best];
    to.y[i] = from.y[best];
    to.z[i] = from.z[best];
    to.range[i] = from.range[best];
    to.point[i] = from.point[best];
  }
}

std::uint32_t face_camera(const RangePlanes& image, std::ptrdiff_t at, const VectorPlanes& normals,
                          float* reach_m2) noexcept {
  std::uint32_t missing = 0;
  for (int lane = 0; lane < kRangeBlock; ++lane) {
    float* const normal[3] = {normals.x + lane, normals.y + lane, normals.z + lane};
    const std::ptrdiff_t here = at + lane;
    const float along =
        (*normal[0] * image.x[here] + *normal[1] * image.y[here]) + *normal[2] * image.z[here];
    for (float* const value : normal) *value = along > 0.0F ? -*value : *value;
    if (!(image.x[here] < kMissing)) {
      reach_m2[lane] = -1.0F;
      continue;
    }
    const bool flat = squared(*normal[0], *normal[1], *normal[2]) == 0.0F;
    if (flat || reach_m2[lane] >= kTooFew_m2) missing |= 1U << lane;
  }
  return missing;
}

void smooth_scores(const float* scores, std::ptrdiff_t at, std::ptrdiff_t stride, float least,
                   float* out) noexcept {
  for (int lane = 0; lane < kRangeBlock; ++lane) {
    const float* const here = scores + at + lane;
    const float own = *here;
    out[lane] = own;
    if (!(own + 0.5F * (1.0F - own) >= least)) continue;
    const auto row = [&](std::ptrdiff_t from) {
      return (here[from - 1] + here[from]) + here[from + 1];
    };
    const float mean = ((row(-stride) + row(stride)) + (here[-1] + here[1])) * 0.125F;
    if (mean * own >= 0.0F) out[lane] = own + (0.5F * mean) * (1.0F - std::fabs(own));
  }
}

void add_votes(const ChangePlanes& changes, std::span<const ChangeRow> rows, const ChangeView& view,
               ChangeVotes& votes) noexcept {
  for (const ChangeRow& row : rows) {
    const int down = std::abs(row.down);
    for (std::int32_t i = row.range.begin; i < row.range.end; ++i) {
      const int across = std::abs(changes.u[i] - view.u);
      const float m2 = squared(changes.x[i] - view.x, changes.y[i] - view.y, changes.z[i] - view.z);
      if (!(m2 <= view.squared_m2) && (down > 2 || across > 2)) continue;
      const std::int32_t column = changes.u[i] - view.left;
      if (!view.every_column && (column < 0 || column > 63 || (row.reached >> column & 1U) == 0)) {
        continue;
      }
      const float change = changes.change[i];
      const float distance = std::sqrt(m2) * view.per_radius;
      const bool beside = down < 2 && across < 2;
      const float near = std::max(1.0F - distance * view.per_optimal, 0.0F);
      if (!view.every_column || beside) {
        votes.calm = std::min(votes.calm, 1.0F - (0.5F * change) * near);
      }
      const float vote = beside ? change : change * (1.0F - distance);
      if (!(vote >= view.least)) continue;
      const float x = view.across_x * changes.dx[i] + view.across_z * changes.dz[i];
      const float y =
          (view.up_x * changes.dx[i] + view.up_y * changes.dy[i]) + view.up_z * changes.dz[i];
      const float length = std::sqrt(x * x + y * y);
      float& cell = votes.cell[cell_of(length > 0.0F ? x / length : 0.0F)];
      cell = std::max(cell, vote);
    }
  }
}

float spread_of(const ChangeVotes& votes) noexcept {
  float best = 0.0F;
  for (int a = 0; a < kDirectionCells; ++a) {
    for (int b = a + 1; b < kDirectionCells; ++b) {
      const int apart = std::min(b - a, kDirectionCells - (b - a));
      const float weight = static_cast<float>(2 * apart) / kDirectionCells;
      best = std::max(best, (votes.cell[a] * votes.cell[b]) * weight);
    }
  }
  return std::sqrt(best);
}

void open_pixels(const RangePlanes& image, const std::uint8_t* state, std::ptrdiff_t at,
                 const PixelWindow& window, const Sphere& sphere, std::uint64_t* open) noexcept {
  for (std::int32_t row = 0; row < window.rows; ++row) {
    open[row] = 0;
    for (std::int32_t column = 0; column < window.columns; ++column) {
      const std::ptrdiff_t i = at + row * image.stride + column;
      const bool within = squared(image.x[i] - sphere.x, image.y[i] - sphere.y,
                                  image.z[i] - sphere.z) <= sphere.squared_m2;
      const bool beside =
          std::abs(row - window.centre_row) <= 2 && std::abs(column - window.centre_column) <= 2;
      if (state[i] != 2 && (within || beside)) open[row] |= std::uint64_t{1} << column;
    }
  }
}

}  // namespace grapnel::kernels::reference
