#include "pipeline/preprocess/row_bands.h"

#include <algorithm>
#include <cstdint>

namespace grapnel {
namespace {

constexpr int kEight = 8;

/// First labelled column of a row, the width where there is none.
int first_labelled(const std::uint8_t* row, int width) noexcept {
  int u = 0;
  while (u + kEight <= width && eight_labels(row + u) == 0) u += kEight;
  while (u < width && row[u] == kNoLabel) ++u;
  return u;
}

/// Behind the last labelled column of a row; 0 where there is none.
int last_labelled(const std::uint8_t* row, int width) noexcept {
  int u = width;
  while (u >= kEight && eight_labels(row + u - kEight) == 0) u -= kEight;
  while (u > 0 && row[u - 1] == kNoLabel) --u;
  return u;
}

}  // namespace

void RowBands::reserve(Arena& arena, const Limits& /*limits*/) {
  bands_ = arena.take<Columns>(kMostRows / kRows + 1);
  labelled_ = arena.take<Columns>(kMostRows / kRows + 1);
}

void RowBands::cover(const WorkingDepth& work) noexcept {
  std::fill_n(bands_.begin(), bands_of(work), Columns{0, work.depth.width});
}

void RowBands::cover_labels(const WorkingDepth& work) noexcept {
  const int width = work.label.width;
  const std::size_t bands = bands_of(work);
  std::fill_n(labelled_.begin(), bands, Columns{width, 0});
  for (int v = 0; v < work.label.height; ++v) {
    const std::uint8_t* row = work.label.row(v);
    const int first = first_labelled(row, width);
    if (first == width) continue;
    Columns& columns = labelled_[static_cast<std::size_t>(v / kRows)];
    columns.begin = std::min(columns.begin, first);
    columns.end = std::max(columns.end, last_labelled(row, width));
  }
  constexpr std::size_t kBeside = kMargin_px / kRows;
  for (std::size_t i = 0; i < bands; ++i) {
    Columns wide{width, 0};
    for (std::size_t k = i > kBeside ? i - kBeside : 0; k < std::min(bands, i + kBeside + 1); ++k) {
      wide.begin = std::min(wide.begin, labelled_[k].begin);
      wide.end = std::max(wide.end, labelled_[k].end);
    }
    const bool any = wide.end > wide.begin;
    bands_[i] =
        any ? Columns{std::max(0, wide.begin - kMargin_px), std::min(width, wide.end + kMargin_px)}
            : Columns{};
  }
}

}  // namespace grapnel
