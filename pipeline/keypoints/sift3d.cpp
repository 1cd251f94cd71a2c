#include "pipeline/keypoints/sift3d.h"

#include <algorithm>
#include <cmath>

#include "base/math.h"
#include "pipeline/keypoints/strongest.h"
#include "pipeline/neighbours/point_blocks.h"

namespace grapnel {

FieldTable sift_fields() noexcept {
  static constexpr std::array<std::string_view, 2> kEngines = {"fast", "reference"};
  static constexpr std::array<std::string_view, 2> kSiftFields = {"intensity", "depth"};
  using P = SiftParams;
  static constexpr std::array kFields = {
      choice_field<&P::engine>("engine", kEngines, "fast, or plain loops in double"),
      choice_field<&P::field>("field", kSiftFields, "what blobs are looked for in"),
      number_field<&P::min_scale_m>("min_scale_m", "m", 0.0, 10.0,
                                    "sigma of the first octave; 0 = min_scale_ratio spacings"),
      number_field<&P::min_scale_ratio>("min_scale_ratio", "spacings", 0.5, 100.0,
                                        "sigma of the first octave in spacings of the surface"),
      number_field<&P::octaves>("octaves", "", 1, 10, "each of twice the last one's scale"),
      number_field<&P::scales_per_octave>("scales_per_octave", "", 1, 5,
                                          "scales searched in an octave"),
      number_field<&P::min_contrast>("min_contrast", "", 0.0, 1000.0,
                                     "least difference of Gaussians, in the field's unit"),
  };
  return kFields;
}

namespace {

/// PCL stops at octaves with fewer points and compares with this many nearest points.
constexpr std::size_t kMinPoints = 25;
constexpr std::size_t kNearest = 25;

/// Sigma of each scale of an octave: scale · 2^((i - 1) / n), i = 0…n + 2.
double sigma_m(double octave_scale_m, std::size_t scale_i, std::size_t per_octave) noexcept {
  const double octaves = (static_cast<double>(scale_i) - 1.0) / static_cast<double>(per_octave);
  return octave_scale_m * math::exp(octaves * 0.6931471805599453);
}

kernels::GaussianScales scales_of(double octave_scale_m, std::size_t per_octave) noexcept {
  kernels::GaussianScales scales;
  scales.per_octave = per_octave;
  for (std::size_t k = 0; k < scales.count(); ++k) {
    const double sigma = sigma_m(octave_scale_m, k, per_octave);
    scales.reach_m2[k] = static_cast<float>(9.0 * sigma * sigma);
    scales.eighth_m2[k] = static_cast<float>(0.0625 / (sigma * sigma));
  }
  return scales;
}

VoxelParams any_leaf() noexcept { return {}; }

}  // namespace

SiftDetector::SiftDetector(const SiftParams& params) noexcept
    : params_(params), voxels_(any_leaf()) {}

void SiftDetector::reserve(Arena& arena, const Limits& limits) {
  Limits own = limits;
  own.max_points = std::max(limits.max_points, limits.max_model_points);
  own.max_input_points = own.max_points;
  voxels_.reserve(arena, own);
  work_.reserve(arena, own.max_points + kernels::kSlack, 0);
  search_.reserve(arena, limits);
  for (std::size_t k = 0; k < static_cast<std::size_t>(params_.scales_per_octave) + 2; ++k) {
    differences_[k] = arena.take<float>(own.max_points);
  }
  ordered_ = arena.take<float>(own.max_points);
  for (std::span<float>& plane : block_planes_) {
    plane = arena.take<float>(2 * own.max_points + 3 * kernels::kSlack);
  }
  extrema_ = arena.take<Extremum>(own.max_points);
  candidates_ = arena.take<Keypoint>(own.max_points);
}

/// Copies the surface's points and the field into work_.
Status SiftDetector::take(const Surface& surface) noexcept {
  if (surface.size == 0) return Error{Code::TooFewPoints, Stage::Keypoints, 0};
  if (surface.size > extrema_.size()) {
    return Error{Code::CapacityExceeded, Stage::Keypoints, static_cast<std::int32_t>(surface.size)};
  }
  if (!surface.all_finite()) return Error{Code::BadParameter, Stage::Keypoints, 0};
  const bool intensity = params_.field == SiftField::Intensity;
  const std::span<float> field = intensity ? surface.intensity : surface.z;
  if (intensity &&
      std::all_of(field.begin(), field.begin() + static_cast<std::ptrdiff_t>(surface.size),
                  [](float value) { return value == 0.0F; })) {
    return Error{Code::ColorMissing, Stage::Keypoints, 0};
  }
  work_.clear();
  work_.size = surface.size;
  std::copy_n(surface.x.begin(), surface.size, work_.x.begin());
  std::copy_n(surface.y.begin(), surface.size, work_.y.begin());
  std::copy_n(surface.z.begin(), surface.size, work_.z.begin());
  std::copy_n(field.begin(), surface.size, work_.intensity.begin());
  return {};
}

void SiftDetector::filter_fast(const kernels::GaussianScales& scales, float reach_m) noexcept {
  for (std::size_t position = 0; position < work_.size; ++position) {
    ordered_[position] = work_.intensity[search_.point_at(position)];
  }
  PointBlocks blocks(search_.planes(), work_.size, reach_m, block_planes_);
  for (std::int32_t block_i = 0; block_i < blocks.size(); ++block_i) {
    const kernels::BlockOfPoints block = blocks.block(block_i);
    float means[kernels::kMaxScales][kernels::kBlock];
    kernels::gaussian_means(search_.planes(), ordered_.data(), block, blocks.near(block_i), scales,
                            means);
    for (std::int32_t lane = 0; lane < block.count; ++lane) {
      const std::size_t i = search_.point_at(static_cast<std::size_t>(block.first + lane));
      for (std::size_t k = 1; k < scales.count(); ++k) {
        differences_[k - 1][i] = means[k][lane] - means[k - 1][lane];
      }
    }
  }
}

void SiftDetector::filter_plainly(const kernels::GaussianScales& scales, float reach_m) noexcept {
  for (std::size_t i = 0; i < work_.size; ++i) {
    const Neighbourhood around = search_.within(i, reach_m);
    double before = 0.0;
    for (std::size_t k = 0; k < scales.count(); ++k) {
      double weighted = 0.0;
      double weight = 0.0;
      for (std::size_t n = 0; n < around.size(); ++n) {
        if (around.squared_m2[n] > scales.reach_m2[k]) continue;
        const double w = math::exp(-8.0 * static_cast<double>(around.squared_m2[n]) *
                                   static_cast<double>(scales.eighth_m2[k]));
        weighted +=
            w * static_cast<double>(work_.intensity[static_cast<std::size_t>(around.index[n])]);
        weight += w;
      }
      const double response = weighted / weight;
      if (k > 0) differences_[k - 1][i] = static_cast<float>(response - before);
      before = response;
    }
  }
}

/// Extreme among `around` at its own scale, strictly so at the adjacent ones.
bool SiftDetector::stands_out(std::size_t point_i, std::size_t difference, float sign,
                              const Neighbourhood& around) const noexcept {
  const float own = sign * differences_[difference][point_i];
  return std::all_of(around.index.begin(), around.index.end(), [&](std::int32_t index) {
    const auto other = static_cast<std::size_t>(index);
    return own >= sign * differences_[difference][other] &&
           own > sign * differences_[difference - 1][other] &&
           own > sign * differences_[difference + 1][other];
  });
}

/// Whether it stands out from the nearest points.
bool SiftDetector::is_extremum(std::size_t point_i, std::size_t difference, float leaf_m) noexcept {
  const float own = differences_[difference][point_i];
  const float below = differences_[difference - 1][point_i];
  const float above = differences_[difference + 1][point_i];
  const bool low = own < below && own < above;
  const bool high = own > below && own > above;
  if (!low && !high) return false;
  const float sign = high ? 1.0F : -1.0F;
  // The points beside are among the nearest, and mostly one of them decides.
  const Neighbourhood beside = search_.within(point_i, 1.5F * leaf_m);
  if (beside.size() <= kNearest && !stands_out(point_i, difference, sign, beside)) return false;
  return stands_out(point_i, difference, sign, search_.nearest(work_.point(point_i), kNearest));
}

void SiftDetector::find_extrema(std::size_t differences, double octave_scale_m) noexcept {
  const auto per_octave = static_cast<std::size_t>(params_.scales_per_octave);
  const auto contrast = static_cast<float>(params_.min_contrast);
  for (std::size_t i = 0; i < work_.size; ++i) {
    for (std::size_t k = 1; k + 1 < differences; ++k) {
      const float strength = std::fabs(differences_[k][i]);
      if (!(strength >= contrast) || !is_extremum(i, k, static_cast<float>(octave_scale_m)))
        continue;
      if (extremum_count_ == extrema_.size()) {
        overflowed_ = true;
        return;
      }
      extrema_[extremum_count_++] = {work_.point(i), strength,
                                     static_cast<float>(sigma_m(octave_scale_m, k, per_octave))};
    }
  }
}

/// Extrema as keypoints of the surface's nearest points.
Status SiftDetector::place(const Surface& surface, KeypointSet& keypoints) noexcept {
  if (extremum_count_ == 0) return {};
  const double spacing = surface.spacing_m > 0.0 ? surface.spacing_m : 1e-3;
  if (const Status built = search_.build(surface, 2.0 * spacing); !built.ok()) return built;
  for (std::size_t k = 0; k < extremum_count_; ++k) {
    const Extremum& extremum = extrema_[k];
    const std::int32_t point = search_.nearest(extremum.place, 1).index[0];
    candidates_[k] = {point, extremum.score, extremum.scale_m,
                      extremum.place - surface.point(static_cast<std::size_t>(point))};
  }
  keep_strongest(candidates_.first(extremum_count_), keypoints);
  if (overflowed_) keypoints.mark_overflowed();
  return {};
}

Status SiftDetector::detect(const Surface& surface, KeypointSet& keypoints) noexcept {
  keypoints.clear();
  extremum_count_ = 0;
  overflowed_ = false;
  double scale =
      params_.min_scale_m > 0.0 ? params_.min_scale_m : params_.min_scale_ratio * surface.spacing_m;
  if (!(scale > 0.0)) return Error{Code::BadParameter, Stage::Keypoints, 0};
  if (const Status taken = take(surface); !taken.ok()) return taken;
  const auto per_octave = static_cast<std::size_t>(params_.scales_per_octave);
  for (int octave = 0; octave < params_.octaves; ++octave, scale *= 2.0) {
    if (const Result<std::size_t> merged = voxels_.apply(work_, scale, 0); !merged.ok()) {
      return Error{merged.error().code, Stage::Keypoints, merged.error().detail};
    }
    if (work_.size < kMinPoints) break;
    const kernels::GaussianScales scales = scales_of(scale, per_octave);
    const auto reach = static_cast<float>(3.0 * sigma_m(scale, scales.count() - 1, per_octave));
    if (const Status built = search_.build(work_, 0.4 * static_cast<double>(reach)); !built.ok()) {
      return Error{built.error().code, Stage::Keypoints, built.error().detail};
    }
    if (params_.engine == Engine::Fast) {
      filter_fast(scales, reach);
    } else {
      filter_plainly(scales, reach);
    }
    find_extrema(scales.count() - 1, scale);
  }
  return place(surface, keypoints);
}

}  // namespace grapnel
