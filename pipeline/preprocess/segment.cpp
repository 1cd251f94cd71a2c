#include "pipeline/preprocess/segment.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace grapnel {

FieldTable segment_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&SegmentParams::min_pixels>("min_pixels", "px", 1, 1000000,
                                               "smallest component"),
      number_field<&SegmentParams::min_area_m2>("min_area_m2", "m2", 0.0, 100.0,
                                                "smallest component, area facing the camera"),
      number_field<&SegmentParams::max_area_m2>("max_area_m2", "m2", 0.0, 100.0,
                                                "largest component; 0 = no limit"),
  };
  return kFields;
}

namespace {

/// Eight pixels a run on average: what is more broken up is noise.
constexpr std::size_t kPixelsPerRun = 8;

}  // namespace

void Segmenter::reserve(Arena& arena, const Limits& limits) {
  const auto width = static_cast<std::size_t>(limits.max_width);
  const auto height = static_cast<std::size_t>(limits.max_height);
  const std::size_t runs = width * height / kPixelsPerRun;
  runs_ = arena.take<Run>(runs);
  row_begin_ = arena.take<std::int32_t>(kMostRows + 1);
  piece_of_root_ = arena.take<std::int32_t>(runs);
  pieces_ = arena.take<Component>(runs);
  order_ = arena.take<std::int32_t>(runs);
}

bool Segmenter::find_runs(const WorkingDepth& work, const DepthGap& gap) noexcept {
  run_count_ = 0;
  bool complete = true;
  for (int v = 0; v < work.label.height; ++v) {
    row_begin_[static_cast<std::size_t>(v)] = static_cast<std::int32_t>(run_count_);
    const std::uint8_t* label = work.label.row(v);
    const std::uint16_t* depth = work.depth.row(v);
    int u = 0;
    while (u < work.label.width) {
      if (u + 8 <= work.label.width && eight_labels(label + u) == 0) {
        u += 8;
        continue;
      }
      if (label[u] == kNoLabel) {
        ++u;
        continue;
      }
      const int begin = u++;
      while (u < work.label.width && label[u] != kNoLabel &&
             gap.continuous(depth[u - 1], depth[u])) {
        ++u;
      }
      if (run_count_ == runs_.size()) {
        complete = false;
        continue;
      }
      const auto index = static_cast<std::int32_t>(run_count_);
      runs_[run_count_++] = {v, begin, u, index};
    }
  }
  row_begin_[static_cast<std::size_t>(work.label.height)] = static_cast<std::int32_t>(run_count_);
  return complete;
}

std::int32_t Segmenter::root(std::int32_t run) noexcept {
  while (true) {
    Run& here = runs_[static_cast<std::size_t>(run)];
    if (here.parent == run) return run;
    here.parent = runs_[static_cast<std::size_t>(here.parent)].parent;
    run = here.parent;
  }
}

void Segmenter::unite(std::int32_t a, std::int32_t b) noexcept {
  a = root(a);
  b = root(b);
  if (a == b) return;
  runs_[static_cast<std::size_t>(std::max(a, b))].parent = std::min(a, b);
}

void Segmenter::join_rows(const WorkingDepth& work, const DepthGap& gap) noexcept {
  for (int v = 1; v < work.label.height; ++v) {
    const auto row = static_cast<std::size_t>(v);
    std::int32_t upper = row_begin_[row - 1];
    std::int32_t lower = row_begin_[row];
    const std::uint16_t* above = work.depth.row(v - 1);
    const std::uint16_t* below = work.depth.row(v);
    while (upper < row_begin_[row] && lower < row_begin_[row + 1]) {
      const Run& a = runs_[static_cast<std::size_t>(upper)];
      const Run& b = runs_[static_cast<std::size_t>(lower)];
      const int begin = std::max(a.begin, b.begin);
      const int end = std::min(a.end, b.end);
      for (int u = begin; u < end; ++u) {
        if (!gap.continuous(above[u], below[u])) continue;
        unite(upper, lower);
        break;
      }
      if (a.end <= b.end) {
        ++upper;
      } else {
        ++lower;
      }
    }
  }
}

std::size_t Segmenter::measure(const WorkingDepth& work) noexcept {
  std::size_t count = 0;
  const double pixel_area = 1.0 / (work.intrinsics.fx * work.intrinsics.fy);
  for (std::size_t i = 0; i < run_count_; ++i) {
    const Run& run = runs_[i];
    const std::int32_t first = root(static_cast<std::int32_t>(i));
    if (first == static_cast<std::int32_t>(i)) {
      piece_of_root_[i] = static_cast<std::int32_t>(count);
      pieces_[count] = Component{};
      pieces_[count].left = run.begin;
      pieces_[count].top = run.row;
      ++count;
    }
    Component& piece =
        pieces_[static_cast<std::size_t>(piece_of_root_[static_cast<std::size_t>(first)])];
    piece.left = std::min(piece.left, run.begin);
    piece.right = std::max(piece.right, run.end);
    piece.bottom = std::max(piece.bottom, run.row + 1);
    piece.pixels += static_cast<std::uint32_t>(run.end - run.begin);
    for (int u = run.begin; u < run.end; ++u) {
      const double z = work.depth_m(u, run.row);
      piece.mean_depth_m += z;
      piece.area_m2 += z * z * pixel_area;
      const double x = (u - work.intrinsics.cx) * z / work.intrinsics.fx;
      const double y = (run.row - work.intrinsics.cy) * z / work.intrinsics.fy;
      piece.centre += Vec3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
    }
  }
  return count;
}

void Segmenter::apply(WorkingDepth& work, Components& components) noexcept {
  components.clear();
  const DepthGap gap(params_.gap, work.intrinsics, work.metres_per_unit);
  const bool complete = find_runs(work, gap);
  join_rows(work, gap);
  const std::size_t count = measure(work);

  std::iota(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(count), 0);
  const auto kept_end = std::remove_if(
      order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(count), [&](std::int32_t i) {
        const Component& piece = pieces_[static_cast<std::size_t>(i)];
        return piece.pixels < static_cast<std::uint32_t>(params_.min_pixels) ||
               piece.area_m2 < params_.min_area_m2 ||
               (params_.max_area_m2 > 0.0 && piece.area_m2 > params_.max_area_m2);
      });
  std::sort(order_.begin(), kept_end, [&](std::int32_t i, std::int32_t j) {
    const double a = pieces_[static_cast<std::size_t>(i)].area_m2;
    const double b = pieces_[static_cast<std::size_t>(j)].area_m2;
    return a != b ? a > b : i < j;
  });
  for (auto it = order_.begin(); it != kept_end; ++it) {
    Component& piece = pieces_[static_cast<std::size_t>(*it)];
    piece.mean_depth_m /= piece.pixels;
    piece.centre /= static_cast<float>(piece.pixels);
    piece.touches_edge = piece.left == 0 || piece.top == 0 || piece.right == work.label.width ||
                         piece.bottom == work.label.height;
    components.push_back(piece);
  }
  if (!complete) components.mark_overflowed();
  write_labels(work, count, {order_.begin(), kept_end});
}

void Segmenter::write_labels(WorkingDepth& work, std::size_t piece_count,
                             std::span<const std::int32_t> kept) noexcept {
  // The pieces are measured; their pixel counts now carry the labels.
  for (std::size_t i = 0; i < piece_count; ++i) pieces_[i].pixels = kForeground;
  for (std::size_t k = 0; k < std::min(kept.size(), kMaxComponents); ++k) {
    pieces_[static_cast<std::size_t>(kept[k])].pixels = static_cast<std::uint32_t>(k + 1);
  }
  for (std::size_t i = 0; i < run_count_; ++i) {
    const Run& run = runs_[i];
    const auto first = static_cast<std::size_t>(root(static_cast<std::int32_t>(i)));
    const auto piece = static_cast<std::size_t>(piece_of_root_[first]);
    std::fill(work.label.row(run.row) + run.begin, work.label.row(run.row) + run.end,
              static_cast<std::uint8_t>(pieces_[piece].pixels));
  }
}

}  // namespace grapnel
