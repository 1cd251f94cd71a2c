#include "pipeline/keypoints/narf.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/math.h"
#include "pipeline/keypoints/strongest.h"

namespace grapnel {

FieldTable narf_fields() noexcept {
  static constexpr std::array<std::string_view, 2> kEngines = {"fast", "reference"};
  using P = NarfParams;
  static constexpr std::array kFields = {
      choice_field<&P::engine>("engine", kEngines, "fast, or plain region growing"),
      number_field<&P::support_m>("support_m", "m", 0.0, 10.0,
                                  "what a keypoint covers; 0 = support_ratio spacings"),
      number_field<&P::support_ratio>("support_ratio", "spacings", 4.0, 1000.0,
                                      "what a keypoint covers in spacings of the surface"),
      number_field<&P::min_interest>("min_interest", "", 0.0, 1.0, "least interest of a keypoint"),
      number_field<&P::min_change>("min_change", "", 0.01, 1.0,
                                   "surface changes below it do not count"),
      number_field<&P::optimal_distance_ratio>("optimal_distance_ratio", "supports", 0.01, 1.0,
                                               "kept between keypoints and strong changes"),
      number_field<&P::min_distance_ratio>("min_distance_ratio", "supports", 0.0, 1.0,
                                           "between two keypoints"),
      number_field<&P::min_border_probability>("min_border_probability", "", 0.1, 1.0,
                                               "least score of a border"),
      bool_field<&P::fill_shadows>("fill_shadows",
                                   "takes what was not seen as lying behind (PCL: false)"),
      number_field<&P::max_shadow_px>("max_shadow_px", "px", 0, 1000,
                                      "wider gaps are far, not filled"),
      bool_field<&P::pyramid>("pyramid", "looks in coarser images near by (PCL: false)"),
      number_field<&P::patch_px>("patch_px", "px", 4, 100,
                                 "width of the support in the pyramid's image"),
  };
  return kFields;
}

namespace {

/// Memory for pixels per point of the limits.
constexpr std::size_t kPixelsPerPoint = 2;
constexpr std::size_t kMinPixels = 16384;
/// A coarser image than this angle a pixel is not made (PCL: 2 degrees).
constexpr double kCoarsest_rad = 2.0 * math::kPi / 180.0;
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

void NarfDetector::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points = std::max(limits.max_points, limits.max_model_points);
  const std::size_t pixels = std::max(kPixelsPerPoint * points, kMinPixels);
  std::size_t room = pixels;
  for (RangeImage& level : levels_) {
    level.reserve(arena, room);
    room = room / 4 + 1;
    if (!params_.pyramid) break;
  }
  borders_.reserve(arena, pixels);
  interest_ = arena.take<float>(pixels);
  active_ = arena.take<std::uint8_t>(pixels);
  promising_ = arena.take<std::uint8_t>(pixels);
  queue_ = arena.take<std::int32_t>(pixels);
  touched_ = arena.take<std::uint8_t>(pixels);
  candidates_ = arena.take<Candidate>(points);
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

/// Pixels that a point within the radius of a place lies at most away; see SphereSums.
double NarfDetector::reach_px(const Vec3d& place) const noexcept {
  if (!(place.z() > radius_m_)) return 1e9;
  const double a = place.x() / place.z();
  const double b = place.y() / place.z();
  return std::max(image().fx, image().fy) * radius_m_ * std::sqrt(1.0 + a * a + b * b) /
         (place.z() - radius_m_);
}

/// Marks the pixels that may reach min_interest: the histogram's spread is at most the largest
/// change within the radius. A box about every such change.
void NarfDetector::mark_promising() noexcept {
  const RangeImage& range = image();
  double widest = 2.0;
  for (std::size_t pixel = 0; pixel < range.pixels(); ++pixel) {
    if (active_[pixel] != 2) widest = std::max(widest, reach_px(range.place(pixel)));
  }
  const int half = static_cast<int>(std::min(widest, 1e6)) + 2;
  const auto sweep = [&](int lines, int length, auto pixel_of, auto seed) {
    for (int line = 0; line < lines; ++line) {
      int last = -2 * half;
      for (int i = 0; i < length + half; ++i) {
        if (i < length && seed(pixel_of(line, i))) last = i;
        if (i >= half && i - half < length) {
          touched_[pixel_of(line, i - half)] = last >= i - 2 * half ? 1 : 0;
        }
      }
    }
    std::copy_n(touched_.begin(), range.pixels(), promising_.begin());
  };
  sweep(
      range.height, range.width, [&](int v, int u) { return range.at(u, v); },
      [&](std::size_t pixel) {
        return active_[pixel] == 1 &&
               static_cast<double>(borders_.change(pixel)) >= params_.min_interest;
      });
  sweep(
      range.width, range.height, [&](int u, int v) { return range.at(u, v); },
      [&](std::size_t pixel) { return promising_[pixel] != 0; });
  std::fill_n(touched_.begin(), range.pixels(), std::uint8_t{0});
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

/// Interest of the level's pixels between two distances, and the candidates among them.
void NarfDetector::look(std::size_t level, double nearest_m, double farthest_m) noexcept {
  level_ = level;
  const RangeImage& range = image();
  BorderParams params;
  params.min_probability = params_.min_border_probability;
  borders_.extract(range, params, params_.min_change);
  for (std::size_t pixel = 0; pixel < range.pixels(); ++pixel) {
    const bool closed = !range.valid(pixel) || borders_.excluded(pixel);
    const bool changing = static_cast<double>(borders_.change(pixel)) >= params_.min_change;
    active_[pixel] = static_cast<std::uint8_t>(closed ? 2 : changing ? 1 : 0);
  }
  if (params_.engine == Engine::Fast) mark_promising();
  for (int v = 0; v < range.height; ++v) {
    for (int u = 0; u < range.width; ++u) {
      const std::size_t pixel = range.at(u, v);
      const auto distance = static_cast<double>(range.range[pixel]);
      const bool wanted = active_[pixel] != 2 && distance >= nearest_m && distance < farthest_m;
      interest_[pixel] = wanted ? static_cast<float>(interest_of(u, v)) : 0.0F;
    }
  }
  add_candidates();
}

/// Pixels of enough interest that no neighbour exceeds.
void NarfDetector::add_candidates() noexcept {
  const RangeImage& range = image();
  const auto least = static_cast<float>(std::max(params_.min_interest, 1e-6));
  for (int v = 0; v < range.height; ++v) {
    for (int u = 0; u < range.width; ++u) {
      const std::size_t pixel = range.at(u, v);
      const float own = interest_[pixel];
      if (range.kind[pixel] != RangeImage::Pixel::Point || !(own >= least)) continue;
      bool exceeded = false;
      for (int v2 = v - 1; v2 <= v + 1; ++v2) {
        for (int u2 = u - 1; u2 <= u + 1; ++u2) {
          exceeded = exceeded || (range.inside(u2, v2) && interest_[range.at(u2, v2)] > own);
        }
      }
      if (exceeded) continue;
      if (candidate_count_ == candidates_.size()) {
        candidates_full_ = true;
        return;
      }
      candidates_[candidate_count_] = {range.point[pixel], own,
                                       static_cast<std::uint32_t>(candidate_count_),
                                       range.place(pixel).cast<float>()};
      ++candidate_count_;
    }
  }
}

/// Strongest first, none within the smallest distance of a stronger one.
void NarfDetector::thin_out(KeypointSet& keypoints) noexcept {
  const std::span<Candidate> all = candidates_.first(candidate_count_);
  std::sort(all.begin(), all.end(), [](const Candidate& a, const Candidate& b) {
    return a.interest != b.interest ? a.interest > b.interest : a.order < b.order;
  });
  const double apart = params_.min_distance_ratio * 2.0 * radius_m_;
  const auto squared = static_cast<float>(apart * apart);
  std::size_t kept = 0;
  for (const Candidate& candidate : all) {
    const auto end = all.begin() + static_cast<std::ptrdiff_t>(kept);
    if (std::any_of(all.begin(), end, [&](const Candidate& other) {
          return (candidate.place - other.place).squaredNorm() < squared;
        })) {
      continue;
    }
    if (kept == keypoints.capacity()) {
      keypoints.mark_overflowed();
      break;
    }
    all[kept++] = candidate;
  }
  std::sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(kept),
            [](const Candidate& a, const Candidate& b) { return a.point < b.point; });
  for (const Candidate& candidate : all.first(kept)) {
    keypoints.push_back({candidate.point, candidate.interest, static_cast<float>(2.0 * radius_m_)});
  }
  if (candidates_full_) keypoints.mark_overflowed();
}

std::size_t NarfDetector::build_levels() noexcept {
  std::size_t levels = 1;
  while (params_.pyramid && levels < kLevels && levels_[levels - 1].width > 8 &&
         levels_[levels - 1].height > 8 &&
         0.5 * levels_[levels - 1].resolution_rad < kCoarsest_rad) {
    halve(levels_[levels - 1], levels_[levels]);
    ++levels;
  }
  return levels;
}

Status NarfDetector::detect(const Surface& surface, KeypointSet& keypoints) noexcept {
  keypoints.clear();
  candidate_count_ = 0;
  candidates_full_ = false;
  const double support =
      params_.support_m > 0.0 ? params_.support_m : params_.support_ratio * surface.spacing_m;
  if (!(support > 0.0)) return Error{Code::BadParameter, Stage::Keypoints, 0};
  radius_m_ = 0.5 * support;
  if (surface.size > candidates_.size()) {
    return Error{Code::CapacityExceeded, Stage::Keypoints, static_cast<std::int32_t>(surface.size)};
  }
  if (const Status seen = see(surface, levels_[0]); !seen.ok()) return seen;
  if (params_.fill_shadows) fill_shadows(levels_[0], params_.max_shadow_px);
  double nearest = std::numeric_limits<double>::max();
  double farthest = 0.0;
  for (std::size_t pixel = 0; pixel < levels_[0].pixels(); ++pixel) {
    if (levels_[0].kind[pixel] != RangeImage::Pixel::Point) continue;
    nearest = std::min(nearest, static_cast<double>(levels_[0].range[pixel]));
    farthest = std::max(farthest, static_cast<double>(levels_[0].range[pixel]));
  }
  const std::size_t levels = build_levels();
  // A level serves the points between the distances at which its support and that of the next finer
  // one are patch_px wide.
  double beyond = std::numeric_limits<double>::max();
  for (std::size_t level = 0; level < levels; ++level) {
    double from = 0.0;
    if (level + 1 < levels) {
      const double angle = params_.patch_px * levels_[level + 1].resolution_rad;
      const double cosine = math::cos(std::min(angle, 1.5));
      from = support * cosine / std::max(math::sin(std::min(angle, 1.5)), 1e-12);
    }
    if (farthest >= from && nearest < beyond) look(level, from, beyond);
    beyond = from;
  }
  thin_out(keypoints);
  return {};
}

}  // namespace grapnel
