#include "pipeline/keypoints/curvature.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "pipeline/keypoints/strongest.h"

namespace grapnel {

namespace {

template <auto kMember>
constexpr Field inner_number(std::string_view name, std::string_view unit, double minimum,
                             double maximum, std::string_view help) {
  Field field = number_field<kMember>(name, unit, minimum, maximum, help);
  field.get_number = [](const void* object) {
    return field_detail::get_number<kMember>(
        &static_cast<const CurvatureKeypointParams*>(object)->curvature);
  };
  field.set_number = [](void* object, double value) {
    field_detail::set_number<kMember>(&static_cast<CurvatureKeypointParams*>(object)->curvature,
                                      value);
  };
  return field;
}

}  // namespace

FieldTable curvature_keypoint_fields() noexcept {
  using P = CurvatureKeypointParams;
  using C = CurvatureParams;
  static constexpr std::array<std::string_view, 2> kEngines = {"fast", "reference"};
  static constexpr Field kEngine = [] {
    Field field = choice_field<&C::engine>("engine", kEngines, "fast, or plain loops in double");
    field.get_number = [](const void* object) {
      return static_cast<double>(static_cast<const P*>(object)->curvature.engine);
    };
    field.set_number = [](void* object, double value) {
      static_cast<P*>(object)->curvature.engine =
          static_cast<Engine>(static_cast<std::uint8_t>(value));
    };
    return field;
  }();
  static constexpr std::array kFields = {
      kEngine,
      inner_number<&C::radius_m>("radius_m", "m", 0.0, 10.0,
                                 "sphere of the normals; 0 = radius_ratio spacings"),
      inner_number<&C::radius_ratio>("radius_ratio", "spacings", 1.0, 50.0,
                                     "sphere of the normals in spacings of the surface"),
      number_field<&P::non_max_radius_m>("non_max_radius_m", "m", 0.0, 10.0,
                                         "one keypoint within; 0 = the sphere of the normals"),
      number_field<&P::min_curvature>("min_curvature", "", 0.0, 1.0,
                                      "least larger principal curvature"),
      number_field<&P::min_ratio>("min_ratio", "", 0.0, 1.0,
                                  "least smaller over larger curvature: 0 ridge, 1 cap"),
      number_field<&P::max_ratio>("max_ratio", "", 0.0, 1.0, "largest smaller over larger"),
  };
  return kFields;
}

void CurvatureDetector::reserve(Arena& arena, const Limits& limits) {
  curvature_.reserve(arena, limits);
  maxima_.reserve(arena, limits);
}

Status CurvatureDetector::detect(const Surface& surface, KeypointSet& keypoints) noexcept {
  keypoints.clear();
  if (const Status done = curvature_.estimate(surface); !done.ok()) {
    return Error{done.error().code, Stage::Keypoints, done.error().detail};
  }
  const double reach =
      params_.non_max_radius_m > 0.0 ? params_.non_max_radius_m : curvature_.radius_m();
  const std::span<const float> pc1 = curvature_.largest();
  const std::span<const float> pc2 = curvature_.smallest();
  const std::span<Keypoint> found = maxima_.find(
      curvature_.search(), pc1, std::max(static_cast<float>(params_.min_curvature), 1e-12F),
      static_cast<float>(reach), 1);
  const auto outside = [&](const Keypoint& keypoint) {
    const auto i = static_cast<std::size_t>(keypoint.point);
    const auto larger = static_cast<double>(pc1[i]);
    const auto smaller = static_cast<double>(pc2[i]);
    return smaller < params_.min_ratio * larger || smaller > params_.max_ratio * larger;
  };
  const auto end = std::remove_if(found.begin(), found.end(), outside);
  const auto kept = found.first(static_cast<std::size_t>(end - found.begin()));
  for (Keypoint& keypoint : kept) keypoint.scale_m = static_cast<float>(curvature_.radius_m());
  keep_strongest(kept, keypoints);
  return {};
}

}  // namespace grapnel
