#include <algorithm>
#include <cmath>

#include "pipeline/kernels/reference.h"

namespace grapnel::kernels::reference {

namespace {

float arc_cosine(float x) noexcept {
  float p = -0.0012624911F;
  for (const float next : {0.0066700901F, -0.0170881256F, 0.0308918810F, -0.0501743046F,
                           0.0889789874F, -0.2145988016F, 1.5707963050F}) {
    p = p * x + next;
  }
  return std::sqrt(1.0F - x) * p;
}

std::int32_t cell_of(float place, float last, float& into) noexcept {
  const float inside = std::max(place, 0.0F);
  const float cell = std::min(std::floor(inside), last);
  into = std::min(inside - cell, 1.0F);
  return static_cast<std::int32_t>(cell);
}

float sum_with(RowScore score, float sum, float a, float b) noexcept {
  const float difference = a - b;
  switch (score) {
    case RowScore::SquaredDifference:
      return sum + difference * difference;
    case RowScore::Difference:
      return sum + std::fabs(difference);
    case RowScore::LargestDifference:
      return std::max(sum, std::fabs(difference));
    case RowScore::RootOfDifference:
      return sum + std::sqrt(std::fabs(difference));
    case RowScore::ChiSquare:
      return a + b == 0.0F ? sum : sum + difference * difference / (a + b);
    case RowScore::Product:
      return sum - a * b;
    case RowScore::Least:
      return sum - std::min(a, b);
  }
  return sum;
}

}  // namespace

void best_rows(RowScore score, const RowBlocks& rows, const float* const* queries,
               std::size_t count, std::size_t kept, BestRow* const* best) noexcept {
  for (std::size_t q = 0; q < count; ++q) {
    for (std::size_t row = 0; row < rows.block_count * kRowsInBlock; ++row) {
      const float* values =
          rows.blocks + row / kRowsInBlock * kRowsInBlock * rows.length + row % kRowsInBlock;
      float sum = rows.bias[row];
      for (std::size_t i = 0; i < rows.length; ++i) {
        sum = sum_with(score, sum, queries[q][i], values[i * kRowsInBlock]);
      }
      std::size_t place = kept;
      for (; place > 0 && sum < best[q][place - 1].score; --place) {
        if (place < kept) best[q][place] = best[q][place - 1];
      }
      if (place < kept) best[q][place] = {sum, static_cast<std::int32_t>(row)};
    }
  }
}

void spin_votes(const OrientedPlanes& points, const SpinFrame& f,
                std::span<const std::int32_t> others, const SpinVotes& votes) noexcept {
  const auto width = static_cast<float>(f.width);
  const float per_cell = 1.0F / f.cell_m;
  for (std::size_t i = 0; i < others.size(); ++i) {
    const std::int32_t other = others[i];
    const float dx = points.x[other] - f.x;
    const float dy = points.y[other] - f.y;
    const float dz = points.z[other] - f.z;
    const float squared = (dx * dx + dy * dy) + dz * dz;
    const float length = std::sqrt(squared);
    const float along = (dx * f.nx + dy * f.ny) + dz * f.nz;
    bool drop = length == 0.0F;
    if (f.min_cos > 0.0F || f.angular) {
      const float cos_normals =
          std::fabs((points.nx[other] * f.nx + points.ny[other] * f.ny) + points.nz[other] * f.nz);
      drop = drop || cos_normals < f.min_cos;
      if (f.angular) votes.angle_rad[i] = arc_cosine(std::min(cos_normals, 1.0F));
    }
    float row = length * per_cell;
    float column = along * per_cell;
    if (f.radial) {
      const float sine = along / (length == 0.0F ? 1.0F : length);
      const float size = 1.57079633F - arc_cosine(std::min(std::fabs(sine), 1.0F));
      column = (sine < 0.0F ? -size : size) * (width * 0.636619772F);
    } else {
      row = std::sqrt(std::max(squared - along * along, 0.0F)) * per_cell;
      drop = drop || row >= width || std::fabs(column) >= width;
    }
    const std::int32_t row_cell = cell_of(row, width - 1.0F, votes.to_next_row[i]);
    const std::int32_t column_cell =
        cell_of(column + width, 2.0F * width - 1.0F, votes.to_next_column[i]);
    votes.cell[i] = drop ? -1 : row_cell * (2 * f.width + 1) + column_cell;
  }
}

void add_weighted_row(const float* row, std::span<const std::int32_t> targets, const float* weights,
                      std::size_t stride, float* matrix) noexcept {
  for (std::size_t i = 0; i < targets.size(); ++i) {
    float* to = matrix + static_cast<std::size_t>(targets[i]) * stride;
    for (std::size_t k = 0; k < kWeightedLength; ++k) to[k] += weights[i] * row[k];
  }
}

std::size_t select_rows(std::span<const std::int32_t> position, const float* squared_m2,
                        const std::int32_t* row_at, std::int32_t* rows, float* weights) noexcept {
  std::size_t found = 0;
  for (std::size_t i = 0; i < position.size(); ++i) {
    const std::int32_t row = row_at[position[i]];
    if (row < 0 || !(squared_m2[i] > 0.0F)) continue;
    rows[found] = row;
    weights[found++] = 1.0F / squared_m2[i];
  }
  return found;
}

std::size_t count_inliers(const PairPlanes& pairs, std::size_t count, const RigidMotion& m,
                          float squared_m2) noexcept {
  std::size_t inliers = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const float x = pairs.sx[i];
    const float y = pairs.sy[i];
    const float z = pairs.sz[i];
    const float dx = ((m.r[0] * x + m.r[1] * y) + (m.r[2] * z + m.t[0])) - pairs.tx[i];
    const float dy = ((m.r[3] * x + m.r[4] * y) + (m.r[5] * z + m.t[1])) - pairs.ty[i];
    const float dz = ((m.r[6] * x + m.r[7] * y) + (m.r[8] * z + m.t[2])) - pairs.tz[i];
    if ((dx * dx + dy * dy) + dz * dz <= squared_m2) ++inliers;
  }
  return inliers;
}

void agreeing_pairs(const PairPlanes& pairs, std::size_t count, std::size_t pair_i,
                    const PairAgreement& agreement, std::uint64_t* bits) noexcept {
  const auto length = [&](const float* x, const float* y, const float* z, std::size_t i) {
    const float dx = x[i] - x[pair_i];
    const float dy = y[i] - y[pair_i];
    const float dz = z[i] - z[pair_i];
    return std::sqrt((dx * dx + dy * dy) + dz * dz);
  };
  std::fill_n(bits, (count + 63) / 64, std::uint64_t{0});
  for (std::size_t i = 0; i < count; ++i) {
    const float source = length(pairs.sx, pairs.sy, pairs.sz, i);
    const float target = length(pairs.tx, pairs.ty, pairs.tz, i);
    if (std::fabs(source - target) > agreement.tolerance_m) continue;
    if (std::min(source, target) >= agreement.min_length_m)
      bits[i / 64] |= std::uint64_t{1} << (i % 64);
  }
}

}  // namespace grapnel::kernels::reference
