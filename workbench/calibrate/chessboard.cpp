#include "workbench/calibrate/chessboard.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <deque>
#include <map>
#include <utility>

namespace grapnel {
namespace {

using Point = Eigen::Vector2d;
using Cell = std::pair<int, int>;  // column, row

constexpr double kSigma_px = 1.5;
constexpr int kRadius_px = 5;  // of the smoothing, and of the window a corner is refined in
constexpr int kBorder_px = 12;
constexpr float kStrength = 0.08F;  // of the strongest saddle
// A step of the grid is found this near to where the last ones point, in steps.
constexpr double kStepTolerance = 0.3;
constexpr std::size_t kMaxSaddles = 4000;

GrayImage smooth(const GrayImage& image) {
  std::array<float, 2 * kRadius_px + 1> weights{};
  float sum = 0.0F;
  for (int i = -kRadius_px; i <= kRadius_px; ++i) {
    const double x = i / kSigma_px;
    weights[static_cast<std::size_t>(i + kRadius_px)] = static_cast<float>(std::exp(-0.5 * x * x));
    sum += weights[static_cast<std::size_t>(i + kRadius_px)];
  }
  GrayImage out = image;
  for (const bool along_rows : {true, false}) {
    const GrayImage in = out;
    for (int v = 0; v < in.height; ++v) {
      for (int u = 0; u < in.width; ++u) {
        float value = 0.0F;
        for (int i = -kRadius_px; i <= kRadius_px; ++i) {
          const int du = along_rows ? std::clamp(u + i, 0, in.width - 1) : u;
          const int dv = along_rows ? v : std::clamp(v + i, 0, in.height - 1);
          value += weights[static_cast<std::size_t>(i + kRadius_px)] * in.at(du, dv);
        }
        out.pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(in.width) +
                   static_cast<std::size_t>(u)] = value / sum;
      }
    }
  }
  return out;
}

/// Ixy² - Ixx Iyy: positive where the image is a saddle.
GrayImage saddle_strength(const GrayImage& image) {
  GrayImage out = image;
  std::fill(out.pixels.begin(), out.pixels.end(), 0.0F);
  for (int v = 1; v + 1 < image.height; ++v) {
    for (int u = 1; u + 1 < image.width; ++u) {
      const float centre = image.at(u, v);
      const float uu = image.at(u + 1, v) - 2.0F * centre + image.at(u - 1, v);
      const float vv = image.at(u, v + 1) - 2.0F * centre + image.at(u, v - 1);
      const float uv = 0.25F * (image.at(u + 1, v + 1) - image.at(u - 1, v + 1) -
                                image.at(u + 1, v - 1) + image.at(u - 1, v - 1));
      out.pixels[static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) +
                 static_cast<std::size_t>(u)] = uv * uv - uu * vv;
    }
  }
  return out;
}

bool is_peak(const GrayImage& strength, int u, int v) {
  const float value = strength.at(u, v);
  for (int dv = -3; dv <= 3; ++dv) {
    for (int du = -3; du <= 3; ++du) {
      const bool before = dv < 0 || (dv == 0 && du < 0);
      const float other = strength.at(u + du, v + dv);
      if (before ? other >= value : other > value) return false;
    }
  }
  return true;
}

/// The point that all edges around it lead to: every gradient in the window is at right angles to
/// the line from it (Förstner 1987).
Point refine(const GrayImage& image, Point corner) {
  for (int round = 0; round < 10; ++round) {
    Eigen::Matrix2d outer = Eigen::Matrix2d::Zero();
    Point moment = Point::Zero();
    const int u0 = static_cast<int>(std::lround(corner.x()));
    const int v0 = static_cast<int>(std::lround(corner.y()));
    if (u0 < kBorder_px || v0 < kBorder_px || u0 + kBorder_px >= image.width ||
        v0 + kBorder_px >= image.height) {
      return corner;
    }
    for (int v = v0 - kRadius_px; v <= v0 + kRadius_px; ++v) {
      for (int u = u0 - kRadius_px; u <= u0 + kRadius_px; ++u) {
        const Point gradient(0.5 * (image.at(u + 1, v) - image.at(u - 1, v)),
                             0.5 * (image.at(u, v + 1) - image.at(u, v - 1)));
        const Point place(u, v);
        const double weight = std::exp(-(place - corner).squaredNorm() / (kRadius_px * kRadius_px));
        outer += weight * gradient * gradient.transpose();
        moment += weight * gradient * gradient.dot(place);
      }
    }
    if (std::abs(outer.determinant()) < 1e-12) return corner;
    const Point next = outer.inverse() * moment;
    const double moved = (next - corner).norm();
    if (!(moved < kRadius_px)) return corner;
    corner = next;
    if (moved < 1e-4) break;
  }
  return corner;
}

/// Around a crossing of two edges, opposite sides are alike: the second harmonic outweighs the
/// first. At a square's outer corner, where only one quadrant is dark, it does not.
bool is_crossing(const GrayImage& image, const Point& corner) {
  constexpr int kSamples = 16;
  constexpr double kReach_px = 4.0;
  constexpr double kPi = 3.14159265358979323846;
  Point first = Point::Zero();
  Point second = Point::Zero();
  for (int i = 0; i < kSamples; ++i) {
    const double angle = 2.0 * kPi * i / kSamples;
    const Point way(std::cos(angle), std::sin(angle));
    const Point place = corner + kReach_px * way;
    const auto value = static_cast<double>(image.at(static_cast<int>(std::lround(place.x())),
                                                    static_cast<int>(std::lround(place.y()))));
    first += value * way;
    second += value * Point(std::cos(2.0 * angle), std::sin(2.0 * angle));
  }
  return second.norm() > 2.0 * first.norm();
}

std::vector<Point> find_saddles(const GrayImage& image) {
  const GrayImage smoothed = smooth(image);
  const GrayImage strength = saddle_strength(smoothed);
  float strongest = 0.0F;
  for (const float value : strength.pixels) strongest = std::max(strongest, value);
  std::vector<Point> saddles;
  for (int v = kBorder_px; v + kBorder_px < image.height; ++v) {
    for (int u = kBorder_px; u + kBorder_px < image.width; ++u) {
      if (strength.at(u, v) < kStrength * strongest || strength.at(u, v) <= 0.0F) continue;
      if (!is_peak(strength, u, v)) continue;
      const Point corner = refine(smoothed, Point(u, v));
      const bool near = (corner - Point(u, v)).norm() < kRadius_px;
      if (near && is_crossing(smoothed, corner)) saddles.push_back(corner);
      if (saddles.size() == kMaxSaddles) return saddles;
    }
  }
  return saddles;
}

/// Grows a grid over the saddle points from one of them.
class Grid {
 public:
  explicit Grid(const std::vector<Point>& points) : points_(points) {}

  /// The corners of a grid of exactly columns × rows around `seed`.
  [[nodiscard]] std::optional<std::vector<Point>> grow(std::size_t seed, int columns, int rows) {
    cells_.clear();
    std::array<Point, 2> steps = {Point::Zero(), Point::Zero()};
    if (!find_steps(points_[seed], steps)) return std::nullopt;
    spread(seed, steps);
    return take(columns, rows);
  }

 private:
  [[nodiscard]] std::optional<std::size_t> nearest(const Point& place, double limit) const {
    std::optional<std::size_t> best;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const double distance = (points_[i] - place).norm();
      if (distance >= limit) continue;
      limit = distance;
      best = i;
    }
    return best;
  }

  /// The step to the nearest neighbour, and to the nearest one across.
  [[nodiscard]] bool find_steps(const Point& centre, std::array<Point, 2>& steps) const {
    double shortest = 1e9;
    for (const Point& point : points_) {
      const double length = (point - centre).norm();
      if (length < 3.0 || length >= shortest) continue;
      shortest = length;
      steps[0] = point - centre;
    }
    double second = 3.0 * shortest;
    bool found = false;
    for (const Point& point : points_) {
      const Point step = point - centre;
      const double length = step.norm();
      if (length < 3.0 || length >= second) continue;
      const double cosine = std::abs(step.dot(steps[0])) / (length * shortest);
      if (cosine > 0.6) continue;
      second = length;
      steps[1] = step;
      found = true;
    }
    return found;
  }

  void spread(std::size_t seed, const std::array<Point, 2>& steps) {
    constexpr std::array<Cell, 4> kWays = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
    std::deque<Cell> open = {{0, 0}};
    cells_[{0, 0}] = seed;
    while (!open.empty()) {
      const Cell cell = open.front();
      open.pop_front();
      const Point here = points_[cells_.at(cell)];
      for (const Cell& way : kWays) {
        const Cell next{cell.first + way.first, cell.second + way.second};
        if (cells_.count(next) != 0) continue;
        const auto before = cells_.find({cell.first - way.first, cell.second - way.second});
        Point step = way.first * steps[0] + way.second * steps[1];
        if (before != cells_.end()) step = here - points_[before->second];
        const auto found = nearest(here + step, kStepTolerance * step.norm());
        if (!found || used(*found)) continue;
        cells_[next] = *found;
        open.push_back(next);
      }
    }
  }

  [[nodiscard]] bool used(std::size_t point) const {
    return std::any_of(cells_.begin(), cells_.end(),
                       [point](const auto& entry) { return entry.second == point; });
  }

  [[nodiscard]] std::optional<std::vector<Point>> take(int columns, int rows) const {
    Cell low{0, 0};
    Cell high{0, 0};
    for (const auto& [cell, point] : cells_) {
      low = {std::min(low.first, cell.first), std::min(low.second, cell.second)};
      high = {std::max(high.first, cell.first), std::max(high.second, cell.second)};
    }
    const int across = high.first - low.first + 1;
    const int down = high.second - low.second + 1;
    if (cells_.size() != static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {
      return std::nullopt;
    }
    const bool turned = across == rows && down == columns && columns != rows;
    if (!turned && (across != columns || down != rows)) return std::nullopt;
    std::vector<Point> corners;
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        const Cell cell = turned ? Cell{low.first + row, low.second + column}
                                 : Cell{low.first + column, low.second + row};
        corners.push_back(points_[cells_.at(cell)]);
      }
    }
    return right_handed(std::move(corners), columns, rows);
  }

  /// A board seen from its front: rows are counted down where columns go to the right.
  [[nodiscard]] static std::vector<Point> right_handed(std::vector<Point> corners, int columns,
                                                       int rows) {
    const Point along = corners[static_cast<std::size_t>(columns - 1)] - corners[0];
    const Point down = corners[static_cast<std::size_t>((rows - 1) * columns)] - corners[0];
    if (along.x() * down.y() - along.y() * down.x() > 0.0) return corners;
    for (int row = 0; row < rows; ++row) {
      const auto first = corners.begin() + static_cast<std::ptrdiff_t>(row) * columns;
      std::reverse(first, first + columns);
    }
    return corners;
  }

  const std::vector<Point>& points_;
  std::map<Cell, std::size_t> cells_;
};

}  // namespace

GrayImage gray_of(ImageView<const Rgb8> color) {
  GrayImage image;
  image.width = color.width;
  image.height = color.height;
  for (int v = 0; v < color.height; ++v) {
    for (int u = 0; u < color.width; ++u) {
      const Rgb8 pixel = color.at(u, v);
      // ITU-R BT.601.
      image.pixels.push_back(0.299F * static_cast<float>(pixel.r) +
                             0.587F * static_cast<float>(pixel.g) +
                             0.114F * static_cast<float>(pixel.b));
    }
  }
  return image;
}

std::optional<std::vector<Point>> find_chessboard(const GrayImage& image, int columns, int rows) {
  const std::vector<Point> saddles = find_saddles(image);
  if (saddles.size() < static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {
    return std::nullopt;
  }
  Grid grid(saddles);
  for (std::size_t seed = 0; seed < saddles.size(); ++seed) {
    if (auto corners = grid.grow(seed, columns, rows)) return corners;
  }
  return std::nullopt;
}

}  // namespace grapnel
