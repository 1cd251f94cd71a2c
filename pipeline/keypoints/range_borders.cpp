#include "pipeline/keypoints/range_borders.h"

#include <algorithm>
#include <cmath>

namespace grapnel {

namespace {

/// Offsets of the four sides; a side's opposite differs in the last bit of its index.
constexpr std::array<int, 4> kDu = {-1, 1, 0, 0};
constexpr std::array<int, 4> kDv = {0, 0, -1, 1};
/// Sides of an obstacle in a pixel's traits while they are classified.
constexpr unsigned kFirstSide = 4;

}  // namespace

void RangeBorders::reserve(Arena& arena, std::size_t max_pixels) {
  reach_m2_ = arena.take<float>(max_pixels);
  for (std::span<float>& plane : normal_) plane = arena.take<float>(max_pixels);
  const std::size_t listed = max_pixels + kernels::kSlack;
  for (std::span<float>& plane : mean_) plane = arena.take<float>(listed);
  for (std::span<Vec3f>* plane : {&border_, &direction_}) *plane = arena.take<Vec3f>(max_pixels);
  code_ = arena.take<float>(max_pixels);
  for (std::span<float>& plane : score_) plane = arena.take<float>(listed);
  before_ = arena.take<float>(listed);
  candidates_ = arena.take<Candidate>(max_pixels);
  traits_ = arena.take<std::uint8_t>(max_pixels);
  change_ = arena.take<float>(max_pixels);
  column_ = arena.take<std::int32_t>(listed);
  listed_before_ = arena.take<std::int32_t>(max_pixels + 1);
}

/// How far the surface beside a pixel jumps away (positive) or toward the camera (negative), -1…1;
/// 0 within the pixel's own reach. The neighbour is the mean of `radius` pixels in the direction.
float RangeBorders::distance_change(int u, int v, int du, int dv, int radius) const noexcept {
  const RangeImage& image = *image_;
  const std::size_t pixel = image.at(u, v);
  if (image.inside(u + du, v + dv) &&
      image.kind[image.at(u + du, v + dv)] == RangeImage::Pixel::Far) {
    return 1.0F;
  }
  Vec3d mean = Vec3d::Zero();
  double range = 0.0;
  double count = 0.0;
  for (int step = 1; step <= radius; ++step) {
    const int u2 = u + step * du;
    const int v2 = v + step * dv;
    if (!image.valid(u2, v2)) continue;
    const std::size_t other = image.at(u2, v2);
    mean += image.place(other);
    range += static_cast<double>(image.range[other]);
    count += 1.0;
  }
  if (count == 0.0) return 0.0F;
  const double squared = (mean / count - image.place(pixel)).squaredNorm();
  const auto reach = static_cast<double>(reach_m2_[pixel]);
  if (squared <= reach) return 0.0F;
  const double score = 1.0 - std::sqrt(reach / squared);
  return static_cast<float>(range / count < static_cast<double>(image.range[pixel]) ? -score
                                                                                    : score);
}

/// Pulls a score toward those around it, where that can lift it to a border.
float RangeBorders::smoothed(std::span<const float> scores, int u, int v) const noexcept {
  constexpr double kBonus = 0.5;
  const auto own = static_cast<double>(scores[image_->at(u, v)]);
  if (own + kBonus * (1.0 - own) < params_.min_probability) return static_cast<float>(own);
  double sum = 0.0;
  double count = 0.0;
  for (int v2 = v - 1; v2 <= v + 1; ++v2) {
    for (int u2 = u - 1; u2 <= u + 1; ++u2) {
      if (!image_->inside(u2, v2) || (u2 == u && v2 == v)) continue;
      sum += static_cast<double>(scores[image_->at(u2, v2)]);
      count += 1.0;
    }
  }
  const double mean = count > 0.0 ? sum / count : 0.0;
  if (mean * own < 0.0) return static_cast<float>(own);
  return static_cast<float>(own + kBonus * mean * (1.0 - std::fabs(own)));
}

void RangeBorders::score_jumps(std::size_t side, int v) noexcept {
  const RangeImage& image = *image_;
  const bool blocks = params_.border_radius_px == 3 && by_blocks();
  if (blocks) {
    const kernels::JumpPlanes planes{image.range.data(), reach_m2_.data()};
    const std::ptrdiff_t step = kDu[side] + kDv[side] * std::ptrdiff_t{image.stride()};
    if (!params_.wanted.empty()) std::fill_n(&before_[image.at(0, v)], image.width, 0.0F);
    each_block(v, [&](std::ptrdiff_t at, int) {
      kernels::jumps(places(), planes, at, step, before_.data() + at);
    });
    return;
  }
  for (int u = 0; u < image.width; ++u) {
    const std::size_t pixel = image.at(u, v);
    before_[pixel] = reach_m2_[pixel] < 0.0F
                         ? 0.0F
                         : distance_change(u, v, kDu[side], kDv[side], params_.border_radius_px);
  }
}

void RangeBorders::smooth(std::size_t side, int v) noexcept {
  const RangeImage& image = *image_;
  // A pixel at the image's edge has fewer around it.
  const bool blocks = by_blocks() && v > 0 && v + 1 < image.height;
  if (blocks) {
    const auto least = static_cast<float>(params_.min_probability);
    if (!params_.wanted.empty()) std::fill_n(&score_[side][image.at(0, v)], image.width, 0.0F);
    each_block(v, [&](std::ptrdiff_t at, int) {
      kernels::smooth_scores(before_.data(), at, image.stride(), least, score_[side].data() + at);
    });
  }
  for (int u = 0; u < image.width; ++u) {
    if (blocks && u == 1) u = image.width - 1;
    score_[side][image.at(u, v)] = smoothed(before_, u, v);
  }
}

void RangeBorders::score_borders() noexcept {
  for (std::size_t side = 0; side < kSides; ++side) {
    for (int v = 0; v < image_->height; ++v) score_jumps(side, v);
    for (int v = 0; v < image_->height; ++v) smooth(side, v);
  }
}

/// Pixels with a score of a border on any side.
void RangeBorders::list_candidates() noexcept {
  constexpr std::size_t kAtOnce = 16;
  const auto least = params_.min_probability;
  const auto largest = [&](std::size_t pixel) {
    return std::max(std::max(score_[0][pixel], score_[1][pixel]),
                    std::max(score_[2][pixel], score_[3][pixel]));
  };
  candidate_count_ = 0;
  for (int v = 0; v < image_->height; ++v) {
    const std::size_t behind = image_->at(image_->width, v);
    for (std::size_t first = image_->at(0, v); first < behind; first += kAtOnce) {
      const std::size_t end = std::min(first + kAtOnce, behind);
      float most = 0.0F;
      for (std::size_t pixel = first; pixel < end; ++pixel) most = std::max(most, largest(pixel));
      if (static_cast<double>(most) < least) continue;
      for (std::size_t pixel = first; pixel < end; ++pixel) {
        if (static_cast<double>(largest(pixel)) < least) continue;
        candidates_[candidate_count_++].pixel = static_cast<std::int32_t>(pixel);
      }
    }
  }
}

/// How many pixels away the shadow border lies that belongs to a border's score, 0 when there is
/// none: the one with the strongest jump toward the camera from the other side. A score without one
/// becomes 0.
int RangeBorders::shadow_of(std::size_t side, int u, int v) noexcept {
  const RangeImage& image = *image_;
  float& score = score_[side][image.at(u, v)];
  if (static_cast<double>(score) < params_.min_probability) return 0;
  const int u1 = u + kDu[side];
  const int v1 = v + kDv[side];
  if (score == 1.0F && image.inside(u1, v1) &&
      image.kind[image.at(u1, v1)] == RangeImage::Pixel::Far) {
    return 1;
  }
  float best = 0.0F;
  int shadow = 0;
  for (int step = 1; step <= params_.border_radius_px; ++step) {
    const int u2 = u + step * kDu[side];
    const int v2 = v + step * kDv[side];
    if (!image.inside(u2, v2)) continue;
    const float other = score_[side ^ 1U][image.at(u2, v2)];
    if (!(other < best)) continue;
    best = other;
    shadow = step;
  }
  if (shadow > 0) {
    const double rest = 1.0 + static_cast<double>(best);
    score =
        static_cast<float>(static_cast<double>(score) * std::max(0.9, 1.0 - rest * rest * rest));
    if (static_cast<double>(score) >= params_.min_probability) return shadow;
  }
  score = 0.0F;
  return 0;
}

/// Whether no pixel on the way to the shadow, nor the one before, has a larger score.
bool RangeBorders::largest_along(std::size_t side, int u, int v, int shadow) const noexcept {
  const RangeImage& image = *image_;
  const std::span<const float> scores = score_[side];
  const float own = scores[image.at(u, v)];
  const int before_u = u - kDu[side];
  const int before_v = v - kDv[side];
  if (image.inside(before_u, before_v) && scores[image.at(before_u, before_v)] > own) return false;
  for (int step = 1; step < shadow; ++step) {
    if (scores[image.at(u + step * kDu[side], v + step * kDv[side])] > own) return false;
  }
  return true;
}

void RangeBorders::classify() noexcept {
  const RangeImage& image = *image_;
  std::fill_n(traits_.begin(), image.pixels(), std::uint8_t{0});
  list_candidates();
  const std::span<Candidate> all = candidates_.first(candidate_count_);
  const auto exclude = [&](std::size_t pixel, std::uint8_t trait) {
    traits_[pixel] |= trait;
    if (image.valid(pixel)) code_[pixel] = -1.0F;
  };
  for (Candidate& candidate : all) {
    const auto pixel = static_cast<std::size_t>(candidate.pixel);
    const int u = image.column_of(pixel);
    const int v = image.row_of(pixel);
    for (std::size_t side = 0; side < kSides; ++side) {
      candidate.shadow[side] = static_cast<std::uint8_t>(shadow_of(side, u, v));
    }
  }
  for (const Candidate& candidate : all) {
    const auto pixel = static_cast<std::size_t>(candidate.pixel);
    const int u = image.column_of(pixel);
    const int v = image.row_of(pixel);
    for (std::size_t side = 0; side < kSides; ++side) {
      const int shadow = candidate.shadow[side];
      if (shadow == 0 || !largest_along(side, u, v, shadow)) continue;
      traits_[image.at(u, v)] |= static_cast<std::uint8_t>(kObstacle | (1U << (kFirstSide + side)));
      for (int step = 1; step <= shadow; ++step) {
        exclude(image.at(u + step * kDu[side], v + step * kDv[side]),
                step == shadow ? kShadow : kVeil);
      }
    }
  }
}

/// From an obstacle border across it, in the pixel's plane; zero where there is none.
Vec3f RangeBorders::border_direction(std::size_t pixel) const noexcept {
  const RangeImage& image = *image_;
  int du = 0;
  int dv = 0;
  for (std::size_t side = 0; side < kSides; ++side) {
    if ((traits_[pixel] & (1U << (kFirstSide + side))) == 0) continue;
    du += kDu[side];
    dv += kDv[side];
  }
  if (du == 0 && dv == 0) return Vec3f::Zero();
  const int u = image.column_of(pixel) + du;
  const int v = image.row_of(pixel) + dv;
  const Vec3d ray((u - image.cx) / image.fx, (v - image.cy) / image.fy, 1.0);
  const Vec3d across = normal(pixel);
  const double slope = across.dot(ray);
  if (slope == 0.0) return Vec3f::Zero();
  const Vec3d place = image.place(pixel);
  const Vec3d mean =
      place + Vec3f(mean_[0][pixel], mean_[1][pixel], mean_[2][pixel]).cast<double>();
  const Vec3d along = ray * (across.dot(mean) / slope) - place;
  const double length = along.norm();
  return length > 0.0 ? Vec3f((along / length).cast<float>()) : Vec3f(Vec3f::Zero());
}

/// Mean of the border directions around each border, those across another border left out; borders
/// with too few are dropped. Into direction_.
void RangeBorders::average_directions() noexcept {
  const RangeImage& image = *image_;
  constexpr float kMinCosine = -0.5F;  // 120 degrees
  const int radius = params_.direction_radius_px;
  std::fill_n(direction_.begin(), image.pixels(), Vec3f(Vec3f::Zero()));
  for (const Candidate& candidate : candidates_.first(candidate_count_)) {
    const auto pixel = static_cast<std::size_t>(candidate.pixel);
    if (!obstacle(pixel) || border_[pixel].isZero(0.0F)) continue;
    const int u = image.column_of(pixel);
    const int v = image.row_of(pixel);
    const Vec3f own = border_[pixel];
    Vec3f sum = own;
    int count = 1;
    for (int v2 = std::max(0, v - radius); v2 <= std::min(v + radius, image.height - 1); ++v2) {
      for (int u2 = std::max(0, u - radius); u2 <= std::min(u + radius, image.width - 1); ++u2) {
        const std::size_t at = image.at(u2, v2);
        if (!obstacle(at) || at == pixel || border_[at].isZero(0.0F)) continue;
        if (border_[at].dot(own) < kMinCosine) continue;
        const double between =
            std::fabs(static_cast<double>(distance_change(u, v, u2 - u, v2 - v, 1)));
        if (between >= 0.95 * params_.min_probability) continue;
        sum += border_[at];
        ++count;
      }
    }
    if (count >= radius + 1) direction_[pixel] = sum / sum.norm();
  }
}

void RangeBorders::extract(const RangeImage& image, const BorderParams& params,
                           double min_change) noexcept {
  image_ = &image;
  params_ = params;
  fit_surfaces();
  for (std::size_t pixel = 0; pixel < image.pixels(); ++pixel) {
    code_[pixel] = reach_m2_[pixel] < 0.0F ? 0.0F : 1.0F;
  }
  score_borders();
  classify();
  for (const Candidate& candidate : candidates_.first(candidate_count_)) {
    const auto pixel = static_cast<std::size_t>(candidate.pixel);
    if (obstacle(pixel)) border_[pixel] = border_direction(pixel);
  }
  average_directions();
  measure_changes(min_change);
  list_changes(min_change);
}

void RangeBorders::list_changes(double min_change) noexcept {
  const RangeImage& image = *image_;
  std::size_t count = 0;
  for (int v = 0; v < image.height; ++v) {
    std::size_t pixel = image.at(0, v);
    for (int u = 0; u < image.width; ++u, ++pixel) {
      listed_before_[pixel] = static_cast<std::int32_t>(count);
      if (static_cast<double>(change_[pixel]) < min_change) continue;
      if (!image.valid(pixel) || excluded(pixel)) continue;
      column_[count] = u;
      mean_[0][count] = image.x[pixel];
      mean_[1][count] = image.y[pixel];
      mean_[2][count] = image.z[pixel];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        score_[axis][count] = direction_[pixel][static_cast<Eigen::Index>(axis)];
      }
      before_[count] = change_[pixel];
      ++count;
    }
    listed_before_[pixel] = static_cast<std::int32_t>(count);
  }
}

kernels::ChangePlanes RangeBorders::changes() const noexcept {
  return {column_.data(),   mean_[0].data(),  mean_[1].data(),  mean_[2].data(),
          score_[0].data(), score_[1].data(), score_[2].data(), before_.data()};
}

}  // namespace grapnel
