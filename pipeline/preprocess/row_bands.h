#pragma once

#include <cstddef>
#include <span>

#include "base/arena.h"
#include "pipeline/limits.h"
#include "pipeline/preprocess/working_depth.h"

namespace grapnel {

/// Columns of an image that a step has to look at, the same in all rows of a band: most of a frame
/// of a belt is the belt.
class RowBands {
 public:
  static constexpr int kRows = 16;       ///< of a band
  static constexpr int kMargin_px = 32;  ///< about what is labelled, both ways

  /// Columns, the upper bound excluded; none where it isn't above the lower one.
  struct Columns {
    int begin = 0;
    int end = 0;
    [[nodiscard]] int width() const noexcept { return end > begin ? end - begin : 0; }
  };

  void reserve(Arena& arena, const Limits& limits);

  /// All columns of all rows.
  void cover(const WorkingDepth& work) noexcept;
  /// Those with a label, and a margin. O(pixels / 8).
  void cover_labels(const WorkingDepth& work) noexcept;

  [[nodiscard]] Columns at(int v) const noexcept {
    return bands_[static_cast<std::size_t>(v / kRows)];
  }

 private:
  [[nodiscard]] std::size_t bands_of(const WorkingDepth& work) const noexcept {
    return static_cast<std::size_t>((work.depth.height + kRows - 1) / kRows);
  }

  std::span<Columns> bands_;
  std::span<Columns> labelled_;
};

}  // namespace grapnel
