#include "pipeline/keypoints/narf.h"

#include <algorithm>
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
/// How far a pixel's border, its direction and its change depend on the pixels around.
constexpr int kBorderReach_px = 16;

}  // namespace

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

/// Pixels that a point within the radius of a place lies at most away; see SphereSums.
double NarfDetector::reach_px(const Vec3d& place) const noexcept {
  if (!(place.z() > radius_m_)) return 1e9;
  const double a = place.x() / place.z();
  const double b = place.y() / place.z();
  return std::max(image().fx, image().fy) * radius_m_ * std::sqrt(1.0 + a * a + b * b) /
         (place.z() - radius_m_);
}

/// Widest reach of the level's surfaces, at least the two pixels that always count.
int NarfDetector::widest_reach_px() const noexcept {
  const RangeImage& range = image();
  double widest = 2.0;
  for (std::size_t pixel = 0; pixel < range.pixels(); ++pixel) {
    if (range.valid(pixel)) widest = std::max(widest, reach_px(range.place(pixel)));
  }
  return static_cast<int>(std::min(widest, 1e6)) + 2;
}

/// Marks a box of `half` pixels about every seed.
template <class Seed>
void NarfDetector::mark_around(int half, const Seed& is_seed,
                               std::span<std::uint8_t> marks) noexcept {
  const RangeImage& range = image();
  const auto sweep = [&](int lines, int length, auto pixel_of, auto seed) {
    for (int line = 0; line < lines; ++line) {
      int last = -2 * half - 1;
      for (int i = 0; i < length + half; ++i) {
        if (i < length && seed(pixel_of(line, i))) last = i;
        if (i >= half && i - half < length) {
          touched_[pixel_of(line, i - half)] = last >= i - 2 * half ? 1 : 0;
        }
      }
    }
    std::copy_n(touched_.begin(), range.pixels(), marks.begin());
  };
  sweep(
      range.height, range.width, [&](int v, int u) { return range.at(u, v); }, is_seed);
  sweep(
      range.width, range.height, [&](int u, int v) { return range.at(u, v); },
      [&](std::size_t pixel) { return marks[pixel] != 0; });
  std::fill_n(touched_.begin(), range.pixels(), std::uint8_t{0});
}

/// Interest of the level's pixels between two distances, and the candidates among them.
void NarfDetector::look(std::size_t level, double nearest_m, double farthest_m) noexcept {
  level_ = level;
  const RangeImage& range = image();
  BorderParams params;
  params.min_probability = params_.min_border_probability;
  params.engine = params_.engine;
  const auto served = [&](std::size_t pixel) {
    const auto distance = static_cast<double>(range.range[pixel]);
    return range.valid(pixel) && distance >= nearest_m && distance < farthest_m;
  };
  const bool fast = params_.engine == Engine::Fast;
  const int reach = fast ? widest_reach_px() : 0;
  if (fast) {
    mark_around(reach + kBorderReach_px, served, promising_);
    params.wanted = promising_.first(range.pixels());
  }
  borders_.extract(range, params, params_.min_change);
  for (std::size_t pixel = 0; pixel < range.pixels(); ++pixel) {
    const bool closed = !range.valid(pixel) || borders_.excluded(pixel);
    const bool changing = static_cast<double>(borders_.change(pixel)) >= params_.min_change;
    active_[pixel] = static_cast<std::uint8_t>(closed ? 2 : changing ? 1 : 0);
  }
  // The histogram's spread is at most the largest change within the radius.
  const auto strong = [&](std::size_t pixel) {
    return active_[pixel] == 1 &&
           static_cast<double>(borders_.change(pixel)) >= params_.min_interest;
  };
  if (fast) mark_around(reach, strong, promising_);
  for (int v = 0; v < range.height; ++v) {
    for (int u = 0; u < range.width; ++u) {
      const std::size_t pixel = range.at(u, v);
      const bool wanted = active_[pixel] != 2 && served(pixel);
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
