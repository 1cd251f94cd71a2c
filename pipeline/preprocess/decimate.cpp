#include "pipeline/preprocess/decimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace grapnel {

FieldTable decimate_fields() noexcept {
  static constexpr std::array kFields = {
      number_field<&DecimateParams::resolution_m>(
          "resolution_m", "m", 0.0, 1.0, "distance of neighbouring points; 0 = from target_points"),
      number_field<&DecimateParams::target_points>("target_points", "", 100, 200000,
                                                   "points wanted when the resolution is auto"),
      number_field<&DecimateParams::min_fill_ratio>(
          "min_fill_ratio", "", 0.0, 1.0, "of a block's pixels that must agree for a point"),
  };
  return kFields;
}

namespace {

struct Selection {
  int left = 0, top = 0, right = 0, bottom = 0;  ///< right and bottom exclusive
  std::size_t pixels = 0;
  double mean_depth_m = 0.0;
};

bool selected(std::uint8_t pixel, std::uint8_t wanted) noexcept {
  return wanted == kForeground ? pixel != kNoLabel : pixel == wanted;
}

/// The row's first pixel that may be selected.
int first_candidate(const std::uint8_t* labels, int width, std::uint8_t wanted) noexcept {
  if (wanted == kForeground) return 0;
  const auto* found = static_cast<const std::uint8_t*>(
      std::memchr(labels, wanted, static_cast<std::size_t>(width)));
  return found == nullptr ? width : static_cast<int>(found - labels);
}

Selection select(const WorkingDepth& work, std::uint8_t label) noexcept {
  Selection selection;
  selection.left = work.label.width;
  selection.top = work.label.height;
  std::uint64_t sum = 0;
  for (int v = 0; v < work.label.height; ++v) {
    const std::uint8_t* labels = work.label.row(v);
    const std::uint16_t* depth = work.depth.row(v);
    int first = -1;
    int last = -1;
    for (int u = first_candidate(labels, work.label.width, label); u < work.label.width; ++u) {
      if (!selected(labels[u], label)) continue;
      if (first < 0) first = u;
      last = u;
      sum += depth[u];
      ++selection.pixels;
    }
    if (first < 0) continue;
    selection.left = std::min(selection.left, first);
    selection.right = std::max(selection.right, last + 1);
    selection.top = std::min(selection.top, v);
    selection.bottom = v + 1;
  }
  if (selection.pixels > 0) {
    selection.mean_depth_m =
        work.metres_per_unit * static_cast<double>(sum) / static_cast<double>(selection.pixels);
  }
  return selection;
}

/// A block of pixels and what of it agrees.
struct Block {
  std::array<std::uint16_t, kMaxStride * kMaxStride> depth{};
  std::array<std::uint16_t, kMaxStride * kMaxStride> pixel{};  ///< dv * kMaxStride + du
  std::array<std::uint16_t, kMaxStride * kMaxStride> sorted{};
  std::size_t size = 0;
};

struct Patch {
  double u = 0.0, v = 0.0, z_m = 0.0, grey = 0.0;
  std::size_t pixels = 0;
};

void gather(const WorkingDepth& work, std::uint8_t label, int left, int top, int right, int bottom,
            Block& block) noexcept {
  block.size = 0;
  for (int v = top; v < bottom; ++v) {
    const std::uint8_t* labels = work.label.row(v);
    const std::uint16_t* depth = work.depth.row(v);
    for (int u = left; u < right; ++u) {
      if (!selected(labels[u], label)) continue;
      block.depth[block.size] = depth[u];
      block.pixel[block.size] = static_cast<std::uint16_t>((v - top) * kMaxStride + (u - left));
      ++block.size;
    }
  }
}

/// Keeps the pixels within the gap of the block's median.
void keep_agreeing(const DepthGap& gap, Block& block) noexcept {
  const auto begin = block.depth.begin();
  const auto end = begin + static_cast<std::ptrdiff_t>(block.size);
  const auto [low, high] = std::minmax_element(begin, end);
  if (*high - *low <= gap.counts(*low)) return;
  const auto middle = block.sorted.begin() + static_cast<std::ptrdiff_t>(block.size / 2);
  const auto sorted_end = std::copy(begin, end, block.sorted.begin());
  std::nth_element(block.sorted.begin(), middle, sorted_end);
  const std::uint16_t median = *middle;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < block.size; ++i) {
    if (!gap.continuous(block.depth[i], median)) continue;
    block.depth[kept] = block.depth[i];
    block.pixel[kept] = block.pixel[i];
    ++kept;
  }
  block.size = kept;
}

Patch centroid(const Block& block, const WorkingDepth& work, int left, int top,
               const ImageView<const Rgb8>& color) noexcept {
  std::uint32_t depth = 0;
  int du = 0;
  int dv = 0;
  double grey = 0.0;
  for (std::size_t i = 0; i < block.size; ++i) {
    const int u = block.pixel[i] % kMaxStride;
    const int v = block.pixel[i] / kMaxStride;
    depth += block.depth[i];
    du += u;
    dv += v;
    if (color.empty()) continue;
    const Rgb8& pixel = color.at(work.left + left + u, work.top + top + v);
    // Rec. 601 luma.
    grey += 0.299 * pixel.r + 0.587 * pixel.g + 0.114 * pixel.b;
  }
  const double inverse = 1.0 / static_cast<double>(block.size);
  return {left + du * inverse, top + dv * inverse, work.metres_per_unit * depth * inverse,
          grey * inverse / 255.0, block.size};
}

void set_grid(const WorkingDepth& work, const Selection& selection, int stride,
              Surface& out) noexcept {
  Surface::Grid& grid = out.grid;
  grid.width = (selection.right - selection.left + stride - 1) / stride;
  grid.height = (selection.bottom - selection.top + stride - 1) / stride;
  Intrinsics& k = grid.intrinsics;
  k.width = grid.width;
  k.height = grid.height;
  k.fx = work.intrinsics.fx / stride;
  k.fy = work.intrinsics.fy / stride;
  // The centre of block 0 lies at pixel (stride - 1)/2 of the selection.
  k.cx = (work.intrinsics.cx - selection.left - 0.5 * (stride - 1)) / stride;
  k.cy = (work.intrinsics.cy - selection.top - 0.5 * (stride - 1)) / stride;
}

/// False when the points do not fit.
bool fill(const WorkingDepth& work, std::uint8_t label, const ImageView<const Rgb8>& color,
          const Selection& selection, const DecimateParams& params, int stride,
          Surface& out) noexcept {
  const DepthGap gap(params.gap, work.intrinsics, work.metres_per_unit);
  const auto needed =
      static_cast<std::size_t>(std::max(1.0, std::ceil(params.min_fill_ratio * stride * stride)));
  set_grid(work, selection, stride, out);
  const std::size_t pixels =
      static_cast<std::size_t>(out.grid.width) * static_cast<std::size_t>(out.grid.height);
  if (pixels > out.grid.point_of.size()) return false;
  std::fill_n(out.grid.point_of.begin(), pixels, -1);
  out.size = 0;
  Block block;
  std::size_t pixel = 0;
  for (int top = selection.top; top < selection.bottom; top += stride) {
    for (int left = selection.left; left < selection.right; left += stride, ++pixel) {
      gather(work, label, left, top, std::min(left + stride, selection.right),
             std::min(top + stride, selection.bottom), block);
      if (block.size < needed) continue;
      keep_agreeing(gap, block);
      if (block.size < needed) continue;
      if (out.size == out.capacity()) return false;
      const Patch patch = centroid(block, work, left, top, color);
      const std::size_t i = out.size++;
      out.z[i] = static_cast<float>(patch.z_m);
      out.x[i] =
          static_cast<float>((patch.u - work.intrinsics.cx) / work.intrinsics.fx * patch.z_m);
      out.y[i] =
          static_cast<float>((patch.v - work.intrinsics.cy) / work.intrinsics.fy * patch.z_m);
      out.nx[i] = out.ny[i] = out.nz[i] = 0.0F;
      out.intensity[i] = static_cast<float>(patch.grey);
      out.grid.point_of[pixel] = static_cast<std::int32_t>(i);
      out.grid.pixel_of[i] = static_cast<std::int32_t>(pixel);
    }
  }
  return true;
}

}  // namespace

Result<int> decimate(const WorkingDepth& work, std::uint8_t label, ImageView<const Rgb8> color,
                     const DecimateParams& params, double resolution_m, Surface& out) noexcept {
  out.clear();
  const Selection selection = select(work, label);
  if (selection.pixels == 0) return Error{Code::TooFewPoints, Stage::Decimate, 0};
  if (!color.empty() &&
      (color.width < work.left + work.depth.width || color.height < work.top + work.depth.height)) {
    color = {};
  }
  const double focal = std::sqrt(work.intrinsics.fx * work.intrinsics.fy);
  const double resolution = resolution_m > 0.0 ? resolution_m : params.resolution_m;
  const double wanted =
      resolution > 0.0 ? resolution * focal / selection.mean_depth_m
                       : std::sqrt(static_cast<double>(selection.pixels) / params.target_points);
  int stride = static_cast<int>(std::clamp(std::floor(wanted + 0.5), 1.0, double{kMaxStride}));
  while (!fill(work, label, color, selection, params, stride, out)) {
    if (stride == kMaxStride) {
      out.clear();
      return Error{Code::CapacityExceeded, Stage::Decimate,
                   static_cast<std::int32_t>(selection.pixels)};
    }
    ++stride;
  }
  if (out.size == 0) {
    out.clear();
    return Error{Code::TooFewPoints, Stage::Decimate, static_cast<std::int32_t>(selection.pixels)};
  }
  out.viewpoint = Vec3f::Zero();
  out.has_viewpoint = true;
  out.spacing_m = stride * selection.mean_depth_m / focal;
  return stride;
}

}  // namespace grapnel
