#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

namespace grapnel {

/// How far apart two rows of bins are; PCL's norms.h and OpenCV's correlation.
enum class Metric : std::uint8_t {
  L2,
  L2Squared,
  L1,
  LInfinity,
  JeffriesMatusita,
  Bhattacharyya,
  Sublinear,
  ChiSquare,
  Divergence,
  Pf,
  K,
  KullbackLeibler,
  Intersection,
  Correlation,
};
/// In the order of Metric; PCL's names in lower case.
inline constexpr std::array<std::string_view, 14> kMetricNames = {
    "l2", "l2_squared", "l1", "linf", "jm", "b",   "sublinear",
    "cs", "div",        "pf", "k",    "kl", "hik", "correlation"};

/// Factors of the two rows, used by Pf and K alone.
struct MetricFactors {
  double source = 1.0;
  double target = 1.0;
};

/// Distance from row `a` of the source to row `b` of the target, smaller is nearer:
///   L2 sqrt Σ(a-b)², L2Squared Σ(a-b)², L1 Σ|a-b|, LInfinity max|a-b|, Sublinear Σ sqrt|a-b|,
///   JeffriesMatusita sqrt Σ(√a-√b)², Bhattacharyya -ln Σ√(ab), ChiSquare Σ(a-b)²/(a+b),
///   Divergence Σ(a-b)ln(a/b), KullbackLeibler Σ a ln(a/b), Pf sqrt Σ(fa-gb)², K Σ|fa-gb|,
///   Intersection 1 - Σ min(a,b) (PCL returns the sum, a similarity), Correlation 1 - r.
/// Undefined terms as in PCL: 0/0 of ChiSquare, a or b of 0 in KullbackLeibler and a of 0 in
/// Divergence count 0; b of 0 below a makes Divergence infinite. Rows without a common bin are
/// infinitely far by Bhattacharyya (PCL gives 0, the nearest of all).
[[nodiscard]] double metric_distance(Metric metric, std::span<const double> a,
                                     std::span<const double> b,
                                     const MetricFactors& factors) noexcept;

/// True for metrics between distributions, whose rows are to sum to 1.
[[nodiscard]] bool compares_distributions(Metric metric) noexcept;

}  // namespace grapnel
