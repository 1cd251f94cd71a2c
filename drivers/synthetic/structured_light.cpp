#include "drivers/synthetic/structured_light.h"

#include <algorithm>
#include <cmath>

#include "base/assert.h"
#include "base/math.h"

namespace grapnel {
namespace {

constexpr std::uint64_t kNoiseStream = 1;
constexpr std::uint64_t kDropStream = 2;
constexpr std::uint64_t kMixStream = 3;

// Difference of disparity between neighbours that counts as an edge: 2.3 cm at 1 m.
constexpr float kEdge_px = 1.0f;
// A surface is in shadow when the projector's nearest one is at least this much nearer: above the
// rounding of the projector's columns on a slope that the sensor can read.
constexpr float kShadowMargin_px = 0.3f;
// Dropouts come in patches of this many pixels, as the sensor matches windows, not pixels.
constexpr int kPatch_px = 3;
// Below this multiple of min_signal a reading begins to fail now and then.
constexpr float kWeakFactor = 3.0f;
// Over this much of the cosine before the grazing limit readings begin to fail.
constexpr float kGrazingBand = 0.10f;

const Field kFields[] = {
    bool_field<&StructuredLightParams::noise>("noise", "random error of the disparity"),
    number_field<&StructuredLightParams::sigma_per_m>(
        "sigma_per_m", "1/m", 0.0, 0.1,
        "standard deviation of depth over its square, noise and quantisation together"),
    number_field<&StructuredLightParams::correlation_px>(
        "correlation_px", "px", 1, 15, "side of the window over which the noise is averaged"),
    number_field<&StructuredLightParams::disparity_step_px>(
        "disparity_step_px", "px", 0.0, 1.0, "quantisation of the disparity; 0: none"),
    bool_field<&StructuredLightParams::shadow>("shadow",
                                               "no reading where the projector is hidden"),
    number_field<&StructuredLightParams::mixed_ratio>(
        "mixed_ratio", "", 0.0, 1.0, "share of edge pixels whose depth lies between both sides"),
    number_field<&StructuredLightParams::grazing_rad>("grazing_rad", "rad", 0.5, 1.571,
                                                      "incidence beyond which nothing is read"),
    number_field<&StructuredLightParams::min_signal>(
        "min_signal", "", 0.0, 1.0, "least albedo · cos(incidence) / z² (z in m) that is read"),
    number_field<&StructuredLightParams::invalid_columns>(
        "invalid_columns", "px", 0, 64, "columns at the left edge that are never read"),
    number_field<&StructuredLightParams::min_range_m>("min_range_m", "m", 0.1, 10.0,
                                                      "nearest depth that is read"),
    number_field<&StructuredLightParams::max_range_m>("max_range_m", "m", 0.1, 60.0,
                                                      "farthest depth that is read"),
};

float unit_of(std::uint64_t bits) { return static_cast<float>(bits >> 40) * 0x1.0p-24f; }

double noise_sigma(const StructuredLightParams& params, double focal_baseline) {
  // sigma_d = f b sigma_z / z²; an even spread over one step has variance step² / 12.
  const double total = focal_baseline * params.sigma_per_m;
  const double step = params.disparity_step_px;
  return std::sqrt(std::max(0.0, total * total - step * step / 12.0));
}

}  // namespace

FieldTable structured_light_fields() { return kFields; }

StructuredLight::StructuredLight(const Intrinsics& intrinsics, double baseline_m,
                                 double metres_per_unit, const StructuredLightParams& params)
    : intrinsics_(intrinsics),
      focal_baseline_(intrinsics.fx * baseline_m),
      metres_per_unit_(metres_per_unit),
      params_(params),
      noise_sigma_px_(noise_sigma(params, focal_baseline_)) {
  GRAPNEL_ASSERT(intrinsics.valid() && baseline_m > 0.0 && metres_per_unit > 0.0);
  const auto width = static_cast<std::size_t>(intrinsics.width);
  const auto height = static_cast<std::size_t>(intrinsics.height);
  const auto border = static_cast<std::size_t>(params.correlation_px - 1);
  disparity_.resize(width * height);
  mixed_.resize(width * height);
  noise_px_.assign(width * height, 0.0f);
  white_.resize(width + border);
  row_sums_.resize(width * (height + border));
  column_sum_.resize(width);
}

void StructuredLight::measure(const SurfaceImages& surface, std::uint64_t seed, std::uint64_t frame,
                              ImageView<std::uint16_t> depth) {
  const Rng rng = Rng(seed).split(frame);
  find_disparity(surface);
  if (params_.shadow && !surface.projector_inverse_depth.empty()) drop_shadow(surface);
  drop_weak(surface, rng.split(kDropStream));
  if (params_.mixed_ratio > 0.0) mix_edges(rng.split(kMixStream));
  if (params_.noise) make_noise(rng.split(kNoiseStream));
  quantise(depth);
}

void StructuredLight::find_disparity(const SurfaceImages& surface) {
  const auto focal_baseline = static_cast<float>(focal_baseline_);
  const auto nearest = static_cast<float>(1.0 / params_.min_range_m);
  const auto farthest = static_cast<float>(1.0 / params_.max_range_m);
  for (int v = 0; v < intrinsics_.height; ++v) {
    const float* inverse_depth = surface.inverse_depth.row(v);
    float* out = disparity_.data() + v * intrinsics_.width;
    for (int u = 0; u < intrinsics_.width; ++u) {
      const float value = inverse_depth[u];
      out[u] = value >= farthest && value <= nearest ? focal_baseline * value : 0.0f;
    }
    std::fill(out, out + std::min(params_.invalid_columns, intrinsics_.width), 0.0f);
  }
}

void StructuredLight::drop_shadow(const SurfaceImages& surface) {
  const auto focal_baseline = static_cast<float>(focal_baseline_);
  const int columns = surface.projector_inverse_depth.width;
  for (int v = 0; v < intrinsics_.height; ++v) {
    const float* projector = surface.projector_inverse_depth.row(v);
    float* row = disparity_.data() + v * intrinsics_.width;
    for (int u = 0; u < intrinsics_.width; ++u) {
      if (row[u] == 0.0f) continue;
      // The images are rectified: the projector's column is u - d, in the same row. Both columns
      // beside it must be hidden, so that a slope does not shade itself.
      const float column = static_cast<float>(u + surface.projector_offset_px) - row[u];
      const int left = static_cast<int>(column);
      if (column < 0.0f || left + 1 >= columns) continue;
      const float nearest = focal_baseline * std::min(projector[left], projector[left + 1]);
      if (nearest > row[u] + kShadowMargin_px) row[u] = 0.0f;
    }
  }
}

void StructuredLight::drop_weak(const SurfaceImages& surface, const Rng& rng) {
  const auto cos_limit = static_cast<float>(math::cos(params_.grazing_rad));
  const auto min_signal = static_cast<float>(params_.min_signal);
  const std::uint64_t key = Rng(rng).next_u64();
  for (int v = 0; v < intrinsics_.height; ++v) {
    const float* inverse_depth = surface.inverse_depth.row(v);
    const float* cosine = surface.cos_incidence.row(v);
    const float* albedo = surface.albedo.row(v);
    float* row = disparity_.data() + v * intrinsics_.width;
    for (int u = 0; u < intrinsics_.width; ++u) {
      const float signal = albedo[u] * cosine[u] * inverse_depth[u] * inverse_depth[u];
      if (cosine[u] > cos_limit + kGrazingBand && signal > kWeakFactor * min_signal) continue;
      const auto patch = static_cast<std::uint64_t>(v / kPatch_px) << 32 |
                         static_cast<std::uint64_t>(u / kPatch_px);
      const float chance = unit_of(Rng::mix(key ^ Rng::mix(patch)));
      const bool grazing = cosine[u] < cos_limit + kGrazingBand * chance;
      const bool weak = signal < min_signal * (1.0f + (kWeakFactor - 1.0f) * chance);
      if (grazing || weak) row[u] = 0.0f;
    }
  }
}

void StructuredLight::mix_edges(const Rng& rng) {
  const std::uint64_t key = Rng(rng).next_u64();
  const auto ratio = static_cast<float>(params_.mixed_ratio);
  const int width = intrinsics_.width;
  std::copy(disparity_.begin(), disparity_.end(), mixed_.begin());
  for (int v = 1; v + 1 < intrinsics_.height; ++v) {
    const float* row = disparity_.data() + v * width;
    for (int u = 1; u + 1 < width; ++u) {
      if (row[u] == 0.0f) continue;
      float other = 0.0f;
      for (const int step : {-1, 1, -width, width}) {
        const float neighbour = row[u + step];
        if (neighbour != 0.0f && std::fabs(neighbour - row[u]) > kEdge_px) other = neighbour;
      }
      if (other == 0.0f) continue;
      const std::uint64_t bits = Rng::mix(key + static_cast<std::uint64_t>(v * width + u));
      if (unit_of(bits) >= ratio) continue;
      mixed_[static_cast<std::size_t>(v * width + u)] =
          row[u] + (other - row[u]) * unit_of(bits << 24);
    }
  }
  disparity_.swap(mixed_);
}

void StructuredLight::make_noise(const Rng& rng) {
  // White noise, even over 16 bits, summed over a window: nearly normal by the central limit, its
  // correlation falls linearly to zero at the window's side. Whole numbers: no rounding anywhere.
  const int window = params_.correlation_px;
  const int width = intrinsics_.width;
  const int rows = intrinsics_.height + window - 1;
  Rng stream = rng;
  for (int v = 0; v < rows; ++v) {
    for (std::size_t i = 0; i < white_.size(); i += 4) {
      std::uint64_t bits = stream.next_u64();
      for (std::size_t k = i; k < std::min(i + 4, white_.size()); ++k, bits >>= 16) {
        white_[k] = static_cast<std::int32_t>(bits & 0xffff) - 0x8000;
      }
    }
    std::int32_t sum = 0;
    for (int k = 0; k + 1 < window; ++k) sum += white_[static_cast<std::size_t>(k)];
    std::int32_t* out = row_sums_.data() + v * width;
    const std::int32_t* oldest = white_.data();
    for (int u = 0; u < width; ++u) {
      sum += oldest[u + window - 1];
      out[u] = sum;
      sum -= oldest[u];
    }
  }
  // Variance of one even 16-bit number is 2^32 / 12; window² of them are summed.
  const auto scale = static_cast<float>(noise_sigma_px_ * std::sqrt(12.0) / 65536.0 / window);
  std::fill(column_sum_.begin(), column_sum_.end(), 0);
  for (int v = 0; v < rows; ++v) {
    const std::int32_t* entering = row_sums_.data() + v * width;
    for (int u = 0; u < width; ++u) column_sum_[static_cast<std::size_t>(u)] += entering[u];
    const int first = v - window + 1;
    if (first < 0) continue;
    const std::int32_t* leaving = row_sums_.data() + first * width;
    float* out = noise_px_.data() + first * width;
    for (int u = 0; u < width; ++u) {
      out[u] = scale * static_cast<float>(column_sum_[static_cast<std::size_t>(u)]);
      column_sum_[static_cast<std::size_t>(u)] -= leaving[u];
    }
  }
}

void StructuredLight::quantise(ImageView<std::uint16_t> depth) const {
  const auto step = static_cast<float>(params_.disparity_step_px);
  const auto counts = static_cast<float>(focal_baseline_ / metres_per_unit_);
  const float inverse_step = step > 0.0f ? 1.0f / step : 0.0f;
  for (int v = 0; v < intrinsics_.height; ++v) {
    const float* disparity = disparity_.data() + v * intrinsics_.width;
    const float* noise = noise_px_.data() + v * intrinsics_.width;
    std::uint16_t* out = depth.row(v);
    for (int u = 0; u < intrinsics_.width; ++u) {
      float value = std::max(disparity[u] + noise[u], 0.0f);
      if (step > 0.0f) {
        value = step * static_cast<float>(static_cast<std::int32_t>(value * inverse_step + 0.5f));
      }
      const bool readable = disparity[u] != 0.0f && value > 0.0f;
      const float count = readable ? counts / value + 0.5f : 0.0f;
      out[u] = count < 65535.0f ? static_cast<std::uint16_t>(count) : std::uint16_t{0};
    }
  }
}

}  // namespace grapnel
