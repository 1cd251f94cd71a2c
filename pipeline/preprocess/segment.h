#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/field.h"
#include "base/fixed_list.h"
#include "base/geometry.h"
#include "pipeline/limits.h"
#include "pipeline/preprocess/depth_gap.h"
#include "pipeline/preprocess/working_depth.h"

namespace grapnel {

struct SegmentParams {
  int min_pixels = 150;
  double min_area_m2 = 0.0;  ///< seen surface, seen face on; 0 = by pixels alone
  double max_area_m2 = 0.0;  ///< 0 = no limit
  DepthGapParams gap;
};

[[nodiscard]] FieldTable segment_fields() noexcept;

/// A connected piece of foreground. Its pixels carry label index + 1.
struct Component {
  std::uint32_t pixels = 0;
  double area_m2 = 0.0;                          ///< sum of the pixels' footprints z²/(fx fy)
  int left = 0, top = 0, right = 0, bottom = 0;  ///< of the region, right and bottom exclusive
  double mean_depth_m = 0.0;
  Vec3f centre = Vec3f::Zero();  ///< mean of its points, camera frame
  bool touches_edge = false;     ///< of the region of interest: cut off there
};

inline constexpr std::size_t kMaxComponents = 32;
/// Largest area first; marked when more than kMaxComponents passed (the largest are kept).
using Components = InlineList<Component, kMaxComponents>;

/// Connected components of the foreground, split where the depth jumps: run-length union-find.
class Segmenter {
 public:
  explicit Segmenter(const SegmentParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits);
  /// Rewrites the labels. When the runs do not fit, the rest of the image stays without component
  /// and the list is marked.
  void apply(WorkingDepth& work, Components& components) noexcept;

 private:
  struct Run {
    std::int32_t row = 0;
    std::int32_t begin = 0;
    std::int32_t end = 0;     ///< exclusive
    std::int32_t parent = 0;  ///< run index; smaller or equal to its own
  };

  bool find_runs(const WorkingDepth& work, const DepthGap& gap) noexcept;
  void join_rows(const WorkingDepth& work, const DepthGap& gap) noexcept;
  std::int32_t root(std::int32_t run) noexcept;
  void unite(std::int32_t a, std::int32_t b) noexcept;
  std::size_t measure(const WorkingDepth& work) noexcept;
  void write_labels(WorkingDepth& work, std::size_t piece_count,
                    std::span<const std::int32_t> kept) noexcept;

  SegmentParams params_;
  std::span<Run> runs_;
  std::size_t run_count_ = 0;
  std::span<std::int32_t> row_begin_;      ///< first run of each row, one more at the end
  std::span<std::int32_t> piece_of_root_;  ///< run → index in pieces_
  std::span<Component> pieces_;
  std::span<std::int32_t> order_;
};

}  // namespace grapnel
