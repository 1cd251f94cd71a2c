#include "pipeline/keypoints/iss.h"

#include <algorithm>
#include <array>
#include <limits>

#include "pipeline/keypoints/strongest.h"
#include "pipeline/neighbours/symmetric3.h"
#include "pipeline/neighbours/widest_gap.h"

namespace grapnel {

FieldTable iss_fields() noexcept {
  static constexpr std::array<std::string_view, 2> kEngines = {"fast", "reference"};
  static constexpr std::array kFields = {
      choice_field<&IssParams::engine>("engine", kEngines, "fast, or plain loops in double"),
      number_field<&IssParams::salient_radius_m>("salient_radius_m", "m", 0.0, 10.0,
                                                 "sphere of the scatter; 0 = 6 spacings"),
      number_field<&IssParams::non_max_radius_m>("non_max_radius_m", "m", 0.0, 10.0,
                                                 "one keypoint within; 0 = 4 spacings"),
      number_field<&IssParams::gamma_21>("gamma_21", "", 0.0, 1.0,
                                         "largest ratio of second to first eigenvalue"),
      number_field<&IssParams::gamma_32>("gamma_32", "", 0.0, 1.0,
                                         "largest ratio of third to second eigenvalue"),
      number_field<&IssParams::min_neighbours>("min_neighbours", "", 1, 1000,
                                               "fewer, the point included, is no keypoint"),
      bool_field<&IssParams::normalise>("normalise",
                                        "divide the scatter by the neighbours (PCL: false)"),
      number_field<&IssParams::min_third_eigenvalue_m2>("min_third_eigenvalue_m2", "m2", 0.0, 1.0,
                                                        "least saliency (PCL: 0)"),
      number_field<&IssParams::border_radius_m>(
          "border_radius_m", "m", 0.0, 10.0,
          "no keypoints this near to a border; 0 = borders count too (PCL: 0)"),
      number_field<&IssParams::border_angle_rad>("border_angle_rad", "rad", 0.1, 6.2,
                                                 "gap between a point's neighbours at a border"),
  };
  return kFields;
}

namespace {

constexpr double kAutoSalientSpacings = 6.0;
constexpr double kAutoNonMaxSpacings = 4.0;
/// Of the largest eigenvalue: below it the smallest is the rounding of float sums.
constexpr double kRounding = 1e-6;

}  // namespace

void IssDetector::reserve(Arena& arena, const Limits& limits) {
  const std::size_t points = std::max(limits.max_points, limits.max_model_points);
  sums_.reserve(arena, limits);
  maxima_.reserve(arena, limits);
  saliency_ = arena.take<float>(points);
  for (std::span<float>& plane : eigenvalues_) {
    plane = arena.take<float>(points + SphereSums::kPadding);
  }
  border_ = arena.take<std::uint8_t>(points);
  edge_ = arena.take<std::uint8_t>(points);
  angles_ = arena.take<float>(points);
}

void IssDetector::find_borders(const Surface& surface) noexcept {
  const auto radius = static_cast<float>(params_.border_radius_m);
  const auto needed = static_cast<std::size_t>(params_.min_neighbours);
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Neighbourhood around = sums_.search().within(i, radius);
    const bool measurable = around.size() >= std::max<std::size_t>(needed, 3);
    edge_[i] = measurable && surface.has_normal(i) &&
                       widest_gap_rad(surface, i, around, angles_) > params_.border_angle_rad
                   ? 1
                   : 0;
  }
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Neighbourhood around = sums_.search().within(i, radius);
    border_[i] = std::any_of(around.index.begin(), around.index.end(), [&](std::int32_t index) {
      return edge_[static_cast<std::size_t>(index)] != 0;
    });
  }
}

/// Eigenvalues descending: the third where all ratios are small enough, else 0.
float IssDetector::saliency(double count, double e1, double e2, double e3) const noexcept {
  if (count < static_cast<double>(params_.min_neighbours)) return 0.0F;
  if (!(e2 < params_.gamma_21 * e1) || !(e3 < params_.gamma_32 * e2)) return 0.0F;
  if (!(e3 > kRounding * e1)) return 0.0F;
  const double value = params_.normalise ? e3 / count : e3;
  return value > params_.min_third_eigenvalue_m2 ? static_cast<float>(value) : 0.0F;
}

void IssDetector::measure_fast(const Surface& surface) noexcept {
  sums_.scatter(false);
  kernels::eigenvalues(sums_.products(), surface.size, eigenvalues_[0].data(),
                       eigenvalues_[1].data(), eigenvalues_[2].data());
  for (std::size_t i = 0; i < surface.size; ++i) {
    const auto value = [&](std::size_t k) { return static_cast<double>(eigenvalues_[k][i]); };
    saliency_[i] = saliency(static_cast<double>(sums_.count()[i]), value(2), value(1), value(0));
  }
}

void IssDetector::measure_plainly(const Surface& surface, double salient_radius_m) noexcept {
  for (std::size_t i = 0; i < surface.size; ++i) {
    const Neighbourhood around = sums_.search().within(i, static_cast<float>(salient_radius_m));
    const Vec3d own = surface.point(i).cast<double>();
    Symmetric3 scatter;
    for (const std::int32_t index : around.index) {
      const Vec3d d = surface.point(static_cast<std::size_t>(index)).cast<double>() - own;
      scatter.add(d.x(), d.y(), d.z());
    }
    const Vec3d e = eigen_symmetric3(scatter).values;
    saliency_[i] = saliency(static_cast<double>(around.size()), e[2], e[1], e[0]);
  }
}

Status IssDetector::detect(const Surface& surface, KeypointSet& keypoints) noexcept {
  keypoints.clear();
  const double salient = params_.salient_radius_m > 0.0 ? params_.salient_radius_m
                                                        : kAutoSalientSpacings * surface.spacing_m;
  const double non_max = params_.non_max_radius_m > 0.0 ? params_.non_max_radius_m
                                                        : kAutoNonMaxSpacings * surface.spacing_m;
  if (!(salient > 0.0) || !(non_max > 0.0)) return Error{Code::BadParameter, Stage::Keypoints, 0};
  if (const Status built = sums_.build(surface, salient); !built.ok()) {
    return Error{built.error().code, Stage::Keypoints, built.error().detail};
  }
  if (params_.border_radius_m > 0.0) {
    find_borders(surface);
  } else {
    std::fill_n(border_.begin(), surface.size, std::uint8_t{0});
  }
  if (params_.engine == Engine::Fast) {
    measure_fast(surface);
  } else {
    measure_plainly(surface, salient);
  }
  for (std::size_t i = 0; i < surface.size; ++i) {
    if (border_[i] != 0) saliency_[i] = 0.0F;
  }
  const std::span<Keypoint> found =
      maxima_.find(sums_.search(), saliency_.first(surface.size), std::numeric_limits<float>::min(),
                   static_cast<float>(non_max), static_cast<std::size_t>(params_.min_neighbours));
  for (Keypoint& keypoint : found) keypoint.scale_m = static_cast<float>(salient);
  keep_strongest(found, keypoints);
  return {};
}

}  // namespace grapnel
