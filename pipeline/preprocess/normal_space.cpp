#include "pipeline/preprocess/normal_space.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/rng.h"
#include "pipeline/preprocess/compact.h"

namespace grapnel {
namespace {

/// Bins: six faces of a cube around the normal, each of 4 × 4 squares.
constexpr std::size_t kBins = 96;
constexpr std::uint8_t kNoNormal = 255;

std::uint8_t bin_of(const Vec3f& n) noexcept {
  Eigen::Index axis = 0;
  if (std::fabs(n[1]) > std::fabs(n[axis])) axis = 1;
  if (std::fabs(n[2]) > std::fabs(n[axis])) axis = 2;
  const float largest = std::fabs(n[axis]);
  if (!(largest > 0.0F)) return kNoNormal;
  const auto quarter = [&](float value) {
    return std::clamp(static_cast<int>(2.0F * (value / largest + 1.0F)), 0, 3);
  };
  const int face = 2 * static_cast<int>(axis) + (n[axis] < 0.0F ? 1 : 0);
  return static_cast<std::uint8_t>(16 * face + 4 * quarter(n[(axis + 1) % 3]) +
                                   quarter(n[(axis + 2) % 3]));
}

/// How many each bin gives, so that all give the same or all they have.
std::array<std::uint32_t, kBins> shares(const std::array<std::uint32_t, kBins>& held,
                                        std::uint32_t wanted) noexcept {
  std::array<std::uint32_t, kBins> share{};
  for (std::uint32_t left = wanted; left > 0;) {
    std::uint32_t open = 0;
    for (std::size_t b = 0; b < kBins; ++b) open += share[b] < held[b] ? 1U : 0U;
    if (open == 0) break;
    const std::uint32_t each = std::max<std::uint32_t>(1, left / open);
    for (std::size_t b = 0; b < kBins && left > 0; ++b) {
      const std::uint32_t more = std::min({each, held[b] - share[b], left});
      share[b] += more;
      left -= more;
    }
  }
  return share;
}

}  // namespace

FieldTable normal_space_fields() noexcept {
  using P = NormalSpaceParams;
  static constexpr std::array kFields = {
      number_field<&P::points>("points", "", 1, 10000000, "points left"),
      number_field<&P::seed>("seed", "", 0, 2000000000, "of the choice within a direction"),
  };
  return kFields;
}

void NormalSpaceSample::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points =
      std::max({limits.max_input_points, limits.max_points, limits.max_model_points});
  keep_ = arena.take<std::uint8_t>(points);
  bin_ = arena.take<std::uint8_t>(points);
}

Result<std::size_t> NormalSpaceSample::apply(Surface& surface) noexcept {
  if (const Status status = check_points(surface, keep_.size(), Stage::Decimate); !status.ok()) {
    return status.error();
  }
  std::array<std::uint32_t, kBins> held{};
  std::uint32_t with_normal = 0;
  for (std::size_t i = 0; i < surface.size; ++i) {
    bin_[i] = bin_of(surface.normal(i));
    if (bin_[i] == kNoNormal) continue;
    ++held[bin_[i]];
    ++with_normal;
  }
  if (with_normal == 0) return Error{Code::TooFewPoints, Stage::Decimate, 0};
  std::array<std::uint32_t, kBins> share =
      shares(held, std::min(with_normal, static_cast<std::uint32_t>(params_.points)));
  Rng rng(static_cast<std::uint64_t>(params_.seed));
  for (std::size_t i = 0; i < surface.size; ++i) {
    keep_[i] = 0;
    if (bin_[i] == kNoNormal) continue;
    const std::size_t b = bin_[i];
    keep_[i] = rng.below(held[b]--) < share[b] ? 1 : 0;
    share[b] -= keep_[i];
  }
  return keep_points(surface, keep_);
}

}  // namespace grapnel
