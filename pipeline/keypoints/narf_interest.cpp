// How interesting a pixel of a range image is: what changes around it and in which directions.
#include <algorithm>
#include <cmath>

#include "pipeline/keypoints/narf.h"

namespace grapnel {

namespace {

/// Half the width of a window that fits a word a row.
constexpr int kHalfWord = 31;
constexpr std::size_t kWordRows = 2 * kHalfWord + 1;

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

kernels::ChangeView NarfDetector::votes_of(const View& view) const noexcept {
  const auto number = [](double value) { return static_cast<float>(value); };
  kernels::ChangeView seen;
  seen.x = number(view.place.x());
  seen.y = number(view.place.y());
  seen.z = number(view.place.z());
  seen.across_x = number(view.across.x());
  seen.across_z = number(view.across.z());
  seen.up_x = number(view.up.x());
  seen.up_y = number(view.up.y());
  seen.up_z = number(view.up.z());
  seen.squared_m2 = number(radius_m_) * number(radius_m_);
  seen.per_radius = number(1.0 / radius_m_);
  seen.per_optimal = number(1.0 / params_.optimal_distance_ratio);
  // No product of two votes, neither above 1, reaches the square of min_interest with less.
  seen.least = number(params_.min_interest * params_.min_interest * (1.0 - 1e-5));
  seen.u = view.u;
  seen.every_column = true;
  return seen;
}

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
    const int u = range.column_of(pixel);
    const int v = range.row_of(pixel);
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

namespace {

/// All of the runs of open pixels that hold one of `from`.
std::uint64_t fill_runs(std::uint64_t from, std::uint64_t open) noexcept {
  const std::uint64_t seeds = from & open;
  // A carry runs up to a run's end; down it goes by doubling steps.
  std::uint64_t filled = (open & ~(open + seeds)) | seeds;
  std::uint64_t run = open;
  for (unsigned step = 1; step < 64; step *= 2) {
    filled |= run & (filled >> step);
    run &= run >> step;
  }
  return filled;
}

std::uint64_t beside(std::uint64_t bits) noexcept { return bits | bits << 1 | bits >> 1; }

/// What of each row of `open` hangs together with `reached`, which starts in the middle row.
void grow(std::span<const std::uint64_t> open, std::span<std::uint64_t> reached) noexcept {
  const std::size_t rows = open.size();
  const std::size_t middle = rows / 2;
  for (std::size_t row = middle + 1; row < rows; ++row) {
    reached[row] = fill_runs(beside(reached[row - 1]), open[row]);
  }
  for (std::size_t row = middle; row-- > 0;) {
    reached[row] = fill_runs(beside(reached[row + 1]), open[row]);
  }
  if (std::equal(open.begin(), open.end(), reached.begin())) return;
  const auto visit = [&](std::size_t row) {
    const std::uint64_t above = row > 0 ? reached[row - 1] : 0;
    const std::uint64_t below = row + 1 < rows ? reached[row + 1] : 0;
    const std::uint64_t now = fill_runs(beside(above | below) | reached[row], open[row]);
    const bool grew = now != reached[row];
    reached[row] = now;
    return grew;
  };
  for (bool grew = true; grew;) {
    grew = false;
    for (std::size_t row = 0; row < rows; ++row) grew = visit(row) || grew;
    for (std::size_t row = rows; row-- > 0;) grew = visit(row) || grew;
  }
}

}  // namespace

/// The same as flood's set, over a window of bits, a word a row.
void NarfDetector::reach_around(const View& view, int half,
                                std::span<std::uint64_t> reached) const noexcept {
  const RangeImage& range = image();
  const int left = std::max(0, view.u - half);
  const int top = std::max(0, view.v - half);
  const kernels::PixelWindow window{std::min(range.width - 1, view.u + half) - left + 1,
                                    std::min(range.height - 1, view.v + half) - top + 1,
                                    view.u - left, view.v - top};
  const Vec3f place = view.place.cast<float>();
  const auto radius = static_cast<float>(radius_m_);
  std::array<std::uint64_t, kWordRows> open{};
  const auto skipped = static_cast<std::size_t>(top - (view.v - half));
  kernels::open_pixels({range.x.data(), range.y.data(), range.z.data(), range.stride()},
                       active_.data(), static_cast<std::ptrdiff_t>(range.at(left, top)), window,
                       {place.x(), place.y(), place.z(), radius * radius}, open.data() + skipped);
  const auto rows = static_cast<std::size_t>(2 * half + 1);
  const int shift = left - (view.u - half);
  for (std::uint64_t& row : open) row <<= shift;
  std::fill(reached.begin(), reached.end(), std::uint64_t{0});
  reached[rows / 2] = fill_runs(std::uint64_t{1} << half, open[rows / 2]);
  grow(std::span<const std::uint64_t>(open).first(rows), reached.first(rows));
}

/// Interest by votes of the changes around, first of all of them, which bounds it from above; 0
/// where it is below min_interest.
double NarfDetector::vote(const View& view) noexcept {
  const RangeImage& range = image();
  const double reach = reach_px(range.at(view.u, view.v));
  const int half = std::max(2, static_cast<int>(std::min(reach, 1e6)) + 2);
  const bool narrow = half < kHalfWord;
  const kernels::ChangeView seen = votes_of(view);
  const int left = std::max(0, view.u - half);
  const int right = std::min(range.width - 1, view.u + half);
  std::array<kernels::ChangeRow, kWordRows> rows;
  std::size_t count = 0;
  kernels::ChangeVotes votes;
  const auto interest = [&] { return votes.calm * votes.calm * kernels::spread_of(votes); };
  for (int v = std::max(0, view.v - half); v <= std::min(range.height - 1, view.v + half); ++v) {
    const PointRange found = borders_.changes_between(left, right, v);
    if (found.begin == found.end) continue;
    rows[count++] = {found, v - view.v, 0};
    if (count < rows.size()) continue;
    kernels::add_votes(borders_.changes(), rows, seen, votes);
    count = 0;
  }
  const std::span<kernels::ChangeRow> rest = std::span<kernels::ChangeRow>(rows).first(count);
  kernels::add_votes(borders_.changes(), rest, seen, votes);
  const auto bound = static_cast<double>(interest());
  if (bound == 0.0 || bound < params_.min_interest) return 0.0;
  if (!narrow) {
    gathered_ = Gathered{};
    flood(view);
    return gathered_.negative * spread_of(gathered_.cells);
  }
  std::array<std::uint64_t, kWordRows> reached;
  reach_around(view, half, reached);
  for (kernels::ChangeRow& row : rest) {
    row.reached = reached[static_cast<std::size_t>(row.down + half)];
  }
  kernels::ChangeView asked = seen;
  asked.every_column = false;
  asked.left = view.u - half;
  votes = {};
  kernels::add_votes(borders_.changes(), rest, asked, votes);
  return static_cast<double>(interest());
}

double NarfDetector::interest_of(int u, int v) noexcept {
  const View view(image(), u, v);
  if (params_.engine != Engine::Fast) {
    gathered_ = Gathered{};
    flood(view);
    return gathered_.negative * spread_of(gathered_.cells);
  }
  return vote(view);
}

}  // namespace grapnel
