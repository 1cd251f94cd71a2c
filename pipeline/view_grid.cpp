#include "pipeline/view_grid.h"

#include <algorithm>
#include <cmath>

#include "pipeline/kernels/window_sums.h"

namespace grapnel {
namespace {

constexpr float kMaxSlack_px = 0.6F;

constexpr std::ptrdiff_t in_strips(std::ptrdiff_t count) noexcept {
  const auto strip = static_cast<std::ptrdiff_t>(kernels::kStrip);
  return (count + strip - 1) / strip * strip;
}

/// Planes of a surface beside the coordinates.
std::array<std::span<float>, 4> attributes_of(const Surface& surface) noexcept {
  return {surface.nx, surface.ny, surface.nz, surface.intensity};
}

void copy_point(const Surface& from, std::size_t i, Surface& to, std::size_t k) noexcept {
  to.x[k] = from.x[i];
  to.y[k] = from.y[i];
  to.z[k] = from.z[i];
  const auto planes = attributes_of(from);
  const auto out = attributes_of(to);
  for (std::size_t p = 0; p < out.size(); ++p) out[p][k] = planes[p][i];
}

}  // namespace

/// A view while it is cut into blocks.
struct ViewGrid::Cut {
  const Surface& view;
  int stride;
  float same_m;
  bool attributes;
  std::size_t others = 0;  ///< readings at the end of `to`, the first one last
};

void ViewGrid::reserve(Arena& arena, const Limits& limits) {
  const auto room = [](int width, int height) {
    return (in_strips(width) + 2 * kReach + kernels::kBlock) * (height + 2 * kReach + 1);
  };
  const auto most = static_cast<std::size_t>(std::max(room(limits.max_width, limits.max_height),
                                                      room(limits.max_height, limits.max_width)));
  for (std::span<float>& plane : place_) plane = arena.take<float>(most);
  inverse_m_ = arena.take<float>(most);
  point_ = arena.take<std::int32_t>(most);
  spans_ =
      arena.take<Span>(static_cast<std::size_t>(std::max(limits.max_width, limits.max_height)));
}

/// Lays the blocks over the pixels that have readings. False where they have no room.
bool ViewGrid::fit(const Surface& view, int stride) noexcept {
  const int width = view.grid.width;
  if (static_cast<std::size_t>(view.grid.height) > spans_.size()) return false;
  std::array<int, 2> low = {width, view.grid.height};
  std::array<int, 2> high = {-1, -1};
  for (int v = 0; v < view.grid.height; ++v) {
    const auto row =
        view.grid.point_of.subspan(static_cast<std::size_t>(v) * static_cast<std::size_t>(width),
                                   static_cast<std::size_t>(width));
    const auto seen = [](std::int32_t point) { return point >= 0; };
    const auto first = std::find_if(row.begin(), row.end(), seen);
    spans_[static_cast<std::size_t>(v)] = {width, -1};
    if (first == row.end()) continue;
    const auto last = std::find_if(row.rbegin(), row.rend(), seen);
    const Span span = {static_cast<int>(first - row.begin()),
                       static_cast<int>(row.rend() - last) - 1};
    spans_[static_cast<std::size_t>(v)] = span;
    low = {std::min(low[0], span.first), std::min(low[1], v)};
    high = {std::max(high[0], span.last), v};
  }
  for (std::size_t axis = 0; axis < 2; ++axis) {
    first_px_[axis] = low[axis];
    blocks_[axis] = std::max(0, high[axis] - low[axis] + stride) / stride;
  }
  row_ = in_strips(blocks_[0]) + 2 * kReach + kernels::kBlock;
  const auto used = static_cast<std::size_t>(row_ * (blocks_[1] + 2 * kReach + 1));
  if (used > point_.size()) return false;
  std::fill_n(place_[0].begin(), used, kernels::kNowhere);
  std::fill_n(place_[1].begin(), used, 0.0F);
  std::fill_n(place_[2].begin(), used, 0.0F);
  std::fill_n(inverse_m_.begin(), used, 0.0F);
  std::fill_n(point_.begin(), used, -1);
  const Intrinsics& camera = view.grid.intrinsics;
  const auto middle = [&](std::size_t axis, double centre) {
    return (centre - first_px_[axis] - 0.5 * (stride - 1)) / stride;
  };
  camera_ = {blocks_[0],         blocks_[1],           camera.fx / stride,
             camera.fy / stride, middle(0, camera.cx), middle(1, camera.cy)};
  projects_ = projects(view);
  return true;
}

/// Whether some hundred of the points lie where their pixels say.
bool ViewGrid::projects(const Surface& view) const noexcept {
  const Intrinsics& camera = view.grid.intrinsics;
  if (!(camera.fx > 0.0) || !(camera.fy > 0.0)) return false;
  constexpr std::size_t kLooks = 500;
  for (std::size_t i = 0; i < view.size; i += view.size / kLooks + 1) {
    const float z = view.z[i];
    if (!(z > 0.0F)) return false;
    const auto u = static_cast<float>(view.grid.pixel_of[i] % view.grid.width);
    const auto v = static_cast<float>(view.grid.pixel_of[i] / view.grid.width);
    const float off_u =
        static_cast<float>(camera.fx) * view.x[i] / z + static_cast<float>(camera.cx) - u;
    const float off_v =
        static_cast<float>(camera.fy) * view.y[i] / z + static_cast<float>(camera.cy) - v;
    if (!(std::fabs(off_u) <= kMaxSlack_px && std::fabs(off_v) <= kMaxSlack_px)) return false;
  }
  return true;
}

bool ViewGrid::take_block(Cut& cut, int u, int v, std::size_t at, Surface& to) noexcept {
  const Surface& view = cut.view;
  std::array<std::size_t, static_cast<std::size_t>(kMaxStride) * kMaxStride> reading;
  std::size_t size = 0;
  float x = 0.0F, y = 0.0F, z = 0.0F, first_m = 0.0F;
  const auto width = static_cast<std::size_t>(view.grid.width);
  const auto columns = static_cast<std::size_t>(std::min(cut.stride, view.grid.width - u));
  const std::int32_t* row =
      view.grid.point_of.data() + static_cast<std::size_t>(v) * width + static_cast<std::size_t>(u);
  for (int rows = std::min(cut.stride, view.grid.height - v); rows > 0; --rows, row += width) {
    for (std::size_t column = 0; column < columns; ++column) {
      if (row[column] < 0) continue;
      const auto i = static_cast<std::size_t>(row[column]);
      const float own_m = view.z[i];
      if (size == 0) first_m = own_m;
      if (std::fabs(own_m - first_m) <= cut.same_m) {
        x += view.x[i];
        y += view.y[i];
        z += own_m;
        reading[size++] = i;
        continue;
      }
      const std::size_t end = to.capacity() - ++cut.others;
      if (end <= to.size) return false;
      copy_point(view, i, to, end);
    }
  }
  if (size == 0) return true;
  const std::size_t mean = to.size++;
  if (mean + cut.others >= to.capacity()) return false;
  const float by = 1.0F / static_cast<float>(size);
  place_[0][at] = to.x[mean] = x * by;
  place_[1][at] = to.y[mean] = y * by;
  place_[2][at] = to.z[mean] = z * by;
  inverse_m_[at] = z > 0.0F ? static_cast<float>(size) / z : 0.0F;
  point_[at] = static_cast<std::int32_t>(mean);
  if (!cut.attributes) return true;
  const auto from = attributes_of(view);
  const auto out = attributes_of(to);
  for (std::size_t k = 0; k < out.size(); ++k) {
    float total = 0.0F;
    for (std::size_t i = 0; i < size; ++i) total += from[k][reading[i]];
    out[k][mean] = total * by;
  }
  return true;
}

bool ViewGrid::take(const Surface& view, int stride, double same_m, bool attributes,
                    Surface& to) noexcept {
  to.clear();
  if (stride < 1 || stride > kMaxStride || !fit(view, stride)) return false;
  Cut cut{view, stride, static_cast<float>(same_m), attributes};
  for (int down = 0; down < blocks_[1]; ++down) {
    const int v = first_px_[1] + down * stride;
    Span span;
    for (int k = v; k < std::min(v + stride, view.grid.height); ++k) {
      span.first = std::min(span.first, spans_[static_cast<std::size_t>(k)].first);
      span.last = std::max(span.last, spans_[static_cast<std::size_t>(k)].last);
    }
    const std::size_t at = row(down);
    for (int across = (span.first - first_px_[0]) / stride;
         first_px_[0] + across * stride <= span.last; ++across) {
      const int u = first_px_[0] + across * stride;
      if (!take_block(cut, u, v, at + static_cast<std::size_t>(across), to)) return false;
    }
  }
  for (std::size_t k = to.capacity() - cut.others; k < to.capacity(); ++k) {
    copy_point(to, k, to, to.size++);
  }
  if (!cut.attributes) {
    for (const std::span<float>& plane : attributes_of(to)) {
      std::fill_n(plane.begin(), to.size, 0.0F);
    }
  }
  to.viewpoint = view.viewpoint;
  to.has_viewpoint = view.has_viewpoint;
  to.spacing_m = stride * view.spacing_m;
  return true;
}
}  // namespace grapnel
