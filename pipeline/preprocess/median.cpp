#include "pipeline/preprocess/median.h"

#include <array>
#include <string_view>

#include "pipeline/kernels/median_row.h"

namespace grapnel {

FieldTable depth_median_fields() noexcept {
  static constexpr std::array<std::string_view, 3> kWindows = {"off", "3x3", "5x5"};
  static constexpr std::array kFields = {
      choice_field<&DepthMedianParams::window>("window", kWindows,
                                               "median of the readings in a window of pixels"),
  };
  return kFields;
}

void DepthMedian::reserve(Arena& arena, const Limits& limits) {
  padded_.reserve(arena, limits);
  all_.reserve(arena, limits);
}

void DepthMedian::apply(WorkingDepth& work) noexcept {
  if (params_.window == MedianWindow::Off) return;
  all_.cover(work);
  apply(work, all_);
}

void DepthMedian::apply(WorkingDepth& work, const RowBands& bands) noexcept {
  if (params_.window == MedianWindow::Off) return;
  const int window = params_.window == MedianWindow::Five ? 5 : 3;
  const int half = window / 2;
  padded_.copy(work.depth);
  for (int v = 0; v < work.depth.height; ++v) {
    const RowBands::Columns columns = bands.at(v);
    if (columns.width() == 0) continue;
    std::array<const std::uint16_t*, 5> rows{};
    for (int i = 0; i < window; ++i) {
      rows[static_cast<std::size_t>(i)] = padded_.row(v + i - half, half) + columns.begin;
    }
    kernels::median_row(rows.data(), window, static_cast<std::size_t>(columns.width()),
                        work.depth.row(v) + columns.begin);
  }
}

}  // namespace grapnel
