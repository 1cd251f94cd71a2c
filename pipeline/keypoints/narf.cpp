#include "pipeline/keypoints/narf.h"

#include <algorithm>
#include <cmath>
#include <cstring>
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

/// Memory for pixels per point of the limits, before the rim's.
constexpr std::size_t kPixelsPerPoint = 2;
constexpr std::size_t kMinPixels = 16384;
/// A coarser image than this angle a pixel is not made (PCL: 2 degrees).
constexpr double kCoarsest_rad = 2.0 * math::kPi / 180.0;
/// How far a pixel's border, its direction and its change depend on the pixels around.
constexpr int kBorderReach_px = 16;

}  // namespace

void NarfDetector::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points = std::max(limits.max_points, limits.max_model_points);
  std::size_t pixels = std::max(kPixelsPerPoint * points, kMinPixels);
  pixels += pixels / 8;
  std::size_t room = pixels;
  for (RangeImage& level : levels_) {
    level.reserve(arena, room);
    // The rim does not halve: a tenth more, as of an image 9 pixels wide.
    room = room / 4 + room / 10 + 1;
    if (!params_.pyramid) break;
  }
  borders_.reserve(arena, pixels);
  interest_ = arena.take<float>(pixels);
  active_ = arena.take<std::uint8_t>(pixels + kernels::kSlack);
  promising_ = arena.take<std::uint8_t>(pixels);
  queue_ = arena.take<std::int32_t>(pixels);
  touched_ = arena.take<std::uint8_t>(pixels);
  candidates_ = arena.take<Candidate>(points);
}

/// Pixels that a point within the radius of a pixel's place lies at most away; see SphereSums. The
/// length of the pixel's ray to depth 1 is its range over its depth.
double NarfDetector::reach_px(std::size_t pixel) const noexcept {
  const auto depth = static_cast<double>(image().z[pixel]);
  if (!(depth > radius_m_)) return 1e9;
  return std::max(image().fx, image().fy) * radius_m_ * static_cast<double>(image().range[pixel]) /
         (depth * (depth - radius_m_)) * (1.0 + 1e-6);
}

void NarfDetector::measure(Served& served) const noexcept {
  const RangeImage& range = image();
  double widest = 2.0;
  served.top = range.height;
  served.bottom = 0;
  for (int v = 0; v < range.height; ++v) {
    const std::size_t first = range.at(0, v);
    const std::size_t end = first + static_cast<std::size_t>(range.width);
    bool any = false;
    for (std::size_t pixel = first; pixel < end; ++pixel) {
      if (!served.holds(range, pixel)) continue;
      any = true;
      widest = std::max(widest, reach_px(pixel));
    }
    if (!any) continue;
    served.top = std::min(served.top, v);
    served.bottom = v + 1;
  }
  const auto reach = [&](double pixels) {
    return std::min(static_cast<int>(std::min(pixels, 1e6)) + 2,
                    std::max(range.width, range.height));
  };
  served.reach = reach(widest);
  served.strong_reach = reach((1.0 - params_.min_interest) * widest);
}

namespace {

/// Every byte becomes the union of itself and those up to `count` - 1 steps behind it.
void unite_ahead(std::span<std::uint8_t> bytes, std::size_t count, std::size_t step) noexcept {
  using Word = std::uint64_t;
  for (std::size_t have = 1; have < count;) {
    const std::size_t more = std::min(have, count - have);
    const std::size_t offset = more * step;
    std::size_t i = 0;
    // Only what lies ahead is read, before it is written.
    for (; i + offset + sizeof(Word) <= bytes.size(); i += sizeof(Word)) {
      Word own = 0;
      Word other = 0;
      std::memcpy(&own, &bytes[i], sizeof(Word));
      std::memcpy(&other, &bytes[i + offset], sizeof(Word));
      own |= other;
      std::memcpy(&bytes[i], &own, sizeof(Word));
    }
    for (; i + offset < bytes.size(); ++i) {
      bytes[i] = static_cast<std::uint8_t>(bytes[i] | bytes[i + offset]);
    }
    have += more;
  }
}

}  // namespace

/// Marks a box of `half` pixels about every seed, at the image's rim more.
template <class Seed>
void NarfDetector::mark_around(int half, const Seed& is_seed,
                               std::span<std::uint8_t> marks) noexcept {
  const std::size_t pixels = image().pixels();
  const auto width = static_cast<std::size_t>(image().stride());
  const auto reach = static_cast<std::size_t>(half);
  const std::span<std::uint8_t> seeds = touched_.first(pixels);
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) seeds[pixel] = is_seed(pixel) ? 1 : 0;
  unite_ahead(seeds, 2 * reach + 1, 1);
  unite_ahead(seeds, 2 * reach + 1, width);
  // Each holds the box whose first corner it is; the first boxes are those of the corner.
  const std::size_t shift = std::min(reach * width + reach, pixels);
  std::fill_n(marks.begin(), shift, std::uint8_t{0});
  for (std::size_t pixel = 0; pixel < shift; pixel += width) {
    const std::size_t count = std::min(width, shift - pixel);
    for (std::size_t u = 0; u < count; ++u) marks[pixel + u] = seeds[u < reach ? 0 : u - reach];
  }
  std::copy_n(seeds.begin(), pixels - shift, marks.begin() + static_cast<std::ptrdiff_t>(shift));
  std::fill(seeds.begin(), seeds.end(), std::uint8_t{0});
}

/// Interest of a level's pixels between two distances, and the candidates among them.
void NarfDetector::look(const RangeImage& level, double nearest_m, double beyond_m) noexcept {
  image_ = level;
  Served served;
  served.nearest_m = static_cast<float>(nearest_m);
  served.beyond_m = static_cast<float>(std::min(beyond_m, 1e30));
  BorderParams params;
  params.min_probability = params_.min_border_probability;
  params.engine = params_.engine;
  if (params_.engine == Engine::Fast) {
    measure(served);
    if (served.top >= served.bottom) return;
    const int margin = served.reach + kBorderReach_px;
    const int top = std::max(0, served.top - margin);
    image_ = rows_of(level, top, std::min(level.height, served.bottom + margin));
    mark_around(
        margin, [&](std::size_t pixel) { return served.holds(image_, pixel); }, promising_);
    params.wanted = promising_.first(image_.pixels());
  }
  borders_.extract(image_, params, params_.min_change);
  score(served);
  add_candidates();
}

void NarfDetector::score(const Served& served) noexcept {
  const RangeImage& range = image();
  for (std::size_t pixel = 0; pixel < range.pixels(); ++pixel) {
    const bool closed = !range.valid(pixel) || borders_.excluded(pixel);
    const bool changing = static_cast<double>(borders_.change(pixel)) >= params_.min_change;
    active_[pixel] = static_cast<std::uint8_t>(closed ? 2 : changing ? 1 : 0);
  }
  const bool fast = params_.engine == Engine::Fast;
  // The histogram's spread is at most its largest vote, which is at most 1 - distance / radius.
  const auto strong = [&](std::size_t pixel) {
    return active_[pixel] == 1 &&
           static_cast<double>(borders_.change(pixel)) >= params_.min_interest;
  };
  if (fast) mark_around(served.strong_reach, strong, promising_);
  // A change disturbs its own pixel most.
  const auto may_be = [&](std::size_t pixel) {
    if (!fast) return true;
    const double calm = 1.0 - 0.5 * static_cast<double>(borders_.change(pixel));
    return promising_[pixel] != 0 && (active_[pixel] != 1 || calm * calm >= params_.min_interest);
  };
  for (int v = 0; v < range.height; ++v) {
    for (int u = 0; u < range.width; ++u) {
      const std::size_t pixel = range.at(u, v);
      const bool wanted = active_[pixel] != 2 && may_be(pixel) && served.holds(range, pixel);
      interest_[pixel] = wanted ? static_cast<float>(interest_of(u, v)) : 0.0F;
    }
  }
}

/// Pixels of enough interest that no neighbour exceeds.
void NarfDetector::add_candidates() noexcept {
  const RangeImage& range = image();
  const auto least = static_cast<float>(std::max(params_.min_interest, 1e-6));
  for (int v = 0; v < range.height; ++v) {
    for (int u = 0; u < range.width; ++u) {
      const std::size_t pixel = range.at(u, v);
      const float own = interest_[pixel];
      if (!(own >= least) || range.kind[pixel] != RangeImage::Pixel::Point) continue;
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

std::size_t NarfDetector::count_levels() const noexcept {
  std::size_t levels = 1;
  int width = levels_[0].width;
  int height = levels_[0].height;
  double resolution_rad = levels_[0].resolution_rad;
  while (params_.pyramid && levels < kLevels && width > 8 && height > 8 &&
         0.5 * resolution_rad < kCoarsest_rad) {
    width /= 2;
    height /= 2;
    resolution_rad *= 2.0;
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
  image_ = levels_[0];
  const auto nearest = static_cast<double>(levels_[0].nearest_m);
  const auto farthest = static_cast<double>(levels_[0].farthest_m);
  const std::size_t levels = count_levels();
  // A level serves the points between the distances at which its support and that of the next finer
  // one are patch_px wide.
  double beyond = std::numeric_limits<double>::max();
  for (std::size_t level = 0; level < levels && nearest < beyond; ++level) {
    if (level > 0) halve(levels_[level - 1], levels_[level]);
    double from = 0.0;
    if (level + 1 < levels) {
      const double angle = 2.0 * params_.patch_px * levels_[level].resolution_rad;
      const double cosine = math::cos(std::min(angle, 1.5));
      from = support * cosine / std::max(math::sin(std::min(angle, 1.5)), 1e-12);
    }
    if (farthest >= from) look(levels_[level], from, beyond);
    beyond = from;
  }
  thin_out(keypoints);
  return {};
}

}  // namespace grapnel
