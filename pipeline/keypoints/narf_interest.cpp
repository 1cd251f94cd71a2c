// How interesting a pixel of a range image is: what changes around it and in which directions.
#include <algorithm>
#include <bit>
#include <cmath>

#include "pipeline/keypoints/narf.h"

namespace grapnel {

namespace {

/// Half the width of a window that fits a word a row.
constexpr int kHalfWord = 31;

/// cos of 10, 20, … 170 degrees.
constexpr std::array<double, 17> kCellEdges = {
    0.984807753012208,    0.9396926207859084,  0.8660254037844387,
    0.766044443118978,    0.6427876096865394,  0.5,
    0.3420201433256688,   0.17364817766693041, 0.0,
    -0.17364817766693033, -0.3420201433256687, -0.5,
    -0.6427876096865393,  -0.766044443118978,  -0.8660254037844387,
    -0.9396926207859083,  -0.984807753012208};

/// Cell of the direction's angle to the image's x axis, its sign lost as in PCL, folded into
/// -90…90 degrees.
std::size_t cell_of(double cosine) noexcept {
  if (cosine <= -1.0) return 9;
  const auto edge = std::find_if(kCellEdges.begin(), kCellEdges.end(),
                                 [&](double value) { return cosine > value; });
  const auto tens = static_cast<std::size_t>(edge - kCellEdges.begin());
  return tens < 9 ? tens + 9 : tens - 9;
}

/// Largest product of two cells and the angle between them, 1 at 90 degrees; its square root.
template <std::size_t kSize>
double spread_of(const std::array<double, kSize>& cells) noexcept {
  double best = 0.0;
  for (std::size_t a = 0; a + 1 < kSize; ++a) {
    if (cells[a] == 0.0) continue;
    for (std::size_t b = a + 1; b < kSize; ++b) {
      const double apart = 2.0 * static_cast<double>(b - a) / static_cast<double>(kSize);
      best = std::max(best, cells[a] * cells[b] * (apart <= 1.0 ? apart : 2.0 - apart));
    }
  }
  return std::sqrt(best);
}

}  // namespace

/// What the surroundings of one pixel are seen by: its place and the axes of a picture plane across
/// its ray, up along -y.
struct NarfDetector::View {
  int u = 0;
  int v = 0;
  Vec3d place = Vec3d::Zero();
  Vec3d across = Vec3d::Zero();
  Vec3d up = Vec3d::Zero();

  View(const RangeImage& image, int u_, int v_) noexcept
      : u(u_), v(v_), place(image.place(image.at(u_, v_))) {
    const Vec3d ray = place / place.norm();
    across = Vec3d(-ray.z(), 0.0, ray.x());
    across /= std::max(across.norm(), 1e-12);
    up = ray.cross(across);
  }
};

/// Adds what a changing pixel says about the view's pixel.
void NarfDetector::gather(const View& view, std::size_t pixel, int distance_px,
                          Gathered& into) const noexcept {
  const auto change = static_cast<double>(borders_.change(pixel));
  const Vec3d direction = borders_.direction(pixel).cast<double>();
  const double distance = (image().place(pixel) - view.place).norm() / radius_m_;
  const double near = std::max(1.0 - distance / params_.optimal_distance_ratio, 0.0);
  const double calm = 1.0 - 0.5 * change * near;
  into.negative = std::min(into.negative, calm * calm);
  const double positive = distance_px < 2 ? change : change * (1.0 - distance);
  const double x = view.across.dot(direction);
  const double y = view.up.dot(direction);
  const double length = std::sqrt(x * x + y * y);
  double& cell = into.cells[cell_of(length > 0.0 ? x / length : 0.0)];
  cell = std::max(cell, positive);
}

/// Grows over all pixels of one surface within the radius (the nearest two pixels always), as PCL.
void NarfDetector::flood(const View& view) noexcept {
  const RangeImage& range = image();
  std::size_t size = 0;
  const auto touch = [&](std::size_t pixel) {
    if (touched_[pixel] != 0) return;
    touched_[pixel] = 1;
    queue_[size++] = static_cast<std::int32_t>(pixel);
  };
  touch(range.at(view.u, view.v));
  for (std::size_t next = 0; next < size; ++next) {
    const auto pixel = static_cast<std::size_t>(queue_[next]);
    if (!range.valid(pixel) || borders_.excluded(pixel)) continue;
    const int u = static_cast<int>(pixel) % range.width;
    const int v = static_cast<int>(pixel) / range.width;
    const int distance_px = std::max(std::abs(u - view.u), std::abs(v - view.v));
    if (distance_px > 2 &&
        (range.place(pixel) - view.place).squaredNorm() > radius_m_ * radius_m_) {
      continue;
    }
    for (int v2 = std::max(0, v - 1); v2 <= std::min(v + 1, range.height - 1); ++v2) {
      for (int u2 = std::max(0, u - 1); u2 <= std::min(u + 1, range.width - 1); ++u2) {
        touch(range.at(u2, v2));
      }
    }
    if (active_[pixel] != 0) gather(view, pixel, distance_px, gathered_);
  }
  for (std::size_t i = 0; i < size; ++i) touched_[static_cast<std::size_t>(queue_[i])] = 0;
}

/// The same over a window of bits, a word a row. False when the radius needs a wider window.
bool NarfDetector::scan(const View& view) noexcept {
  const RangeImage& range = image();
  const double reach = reach_px(view.place);
  if (!(reach + 2.0 < kHalfWord)) return false;
  const int half = std::max(2, static_cast<int>(reach) + 2);
  const int rows = 2 * half + 1;
  std::array<std::uint64_t, 2 * kHalfWord + 1> open{};
  std::array<std::uint64_t, 2 * kHalfWord + 1> changing{};
  std::uint64_t any = 0;
  const int left = std::max(0, view.u - half);
  const int right = std::min(range.width - 1, view.u + half);
  for (int row = 0; row < rows; ++row) {
    const int v = view.v - half + row;
    if (v < 0 || v >= range.height) continue;
    for (int u = left; u <= right; ++u) {
      const std::size_t pixel = range.at(u, v);
      if (active_[pixel] == 2) continue;
      if (std::max(std::abs(u - view.u), std::abs(v - view.v)) > 2 &&
          (range.place(pixel) - view.place).squaredNorm() > radius_m_ * radius_m_) {
        continue;
      }
      const std::uint64_t bit = std::uint64_t{1} << (u - view.u + half);
      open[static_cast<std::size_t>(row)] |= bit;
      if (active_[pixel] == 1) changing[static_cast<std::size_t>(row)] |= bit;
    }
    any |= changing[static_cast<std::size_t>(row)];
  }
  if (any == 0) return true;
  std::array<std::uint64_t, 2 * kHalfWord + 1> reached{};
  reached[static_cast<std::size_t>(half)] = std::uint64_t{1} << half;
  const auto spread = [&](std::size_t row, std::uint64_t from) {
    std::uint64_t now = (reached[row] | from | from << 1 | from >> 1) & open[row];
    for (std::uint64_t before = 0; before != now;) {
      before = now;
      now |= (now << 1 | now >> 1) & open[row];
    }
    const bool grew = now != reached[row];
    reached[row] = now;
    return grew;
  };
  const auto last = static_cast<std::size_t>(rows - 1);
  for (bool grew = true; grew;) {
    grew = false;
    for (std::size_t row = 0; row <= last; ++row) {
      grew = spread(row, row > 0 ? reached[row - 1] : 0) || grew;
    }
    for (std::size_t row = last + 1; row-- > 0;) {
      grew = spread(row, row < last ? reached[row + 1] : 0) || grew;
    }
  }
  for (int row = 0; row < rows; ++row) {
    const auto i = static_cast<std::size_t>(row);
    for (std::uint64_t bits = reached[i] & changing[i]; bits != 0; bits &= bits - 1) {
      if (gathered_.negative < params_.min_interest) return true;
      const int column = std::countr_zero(bits);
      const std::size_t pixel = range.at(view.u - half + column, view.v - half + row);
      gather(view, pixel, std::max(std::abs(column - half), std::abs(row - half)), gathered_);
    }
  }
  return true;
}

double NarfDetector::interest_of(int u, int v) noexcept {
  const bool fast = params_.engine == Engine::Fast;
  const std::size_t pixel = image().at(u, v);
  if (fast) {
    const double calm = 1.0 - 0.5 * static_cast<double>(borders_.change(pixel));
    const bool too_near = active_[pixel] == 1 && calm * calm < params_.min_interest;
    if (promising_[pixel] == 0 || too_near) return 0.0;
  }
  const View view(image(), u, v);
  gathered_ = Gathered{};
  if (!fast || !scan(view)) flood(view);
  if (fast && gathered_.negative < params_.min_interest) return 0.0;
  return gathered_.negative * spread_of(gathered_.cells);
}

}  // namespace grapnel
