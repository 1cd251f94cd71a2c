#include "pipeline/method_slots.h"

namespace grapnel {
namespace {

// Poses are brought near first: few points and iterations for each of many.
constexpr std::string_view kCoarseRefinement = R"(
[icp]
max_iterations = 7
max_points = 300
start_distance_ratio = 6.0
end_distance_ratio = 2.5
anneal_iterations = 5
max_normal_angle_rad = 1.1
[generalized_icp]
max_iterations = 7
max_points = 300
max_distance_ratio = 6.0
[plain_icp]
max_iterations = 10
max_points = 300
max_distance_ratio = 6.0
)";
constexpr std::string_view kFineRefinement = R"(
[icp]
max_iterations = 10
max_points = 800
start_distance_ratio = 2.5
end_distance_ratio = 1.0
anneal_iterations = 5
convergence_m = 1e-4
convergence_rad = 2e-4
[generalized_icp]
max_iterations = 12
max_points = 800
max_distance_ratio = 2.0
convergence_m = 1e-4
convergence_rad = 2e-4
[plain_icp]
max_iterations = 20
max_points = 800
max_distance_ratio = 2.0
)";

}  // namespace

MethodSlots method_slots() noexcept {
  MethodSlots slots;
  slots.normals = {"normals", normal_estimators(), "pca", "", false};
  slots.keypoints = {"keypoints", keypoint_detectors(), "iss", "", false};
  slots.descriptors = {"descriptors", descriptor_estimators(), "fpfh", "", false};
  slots.match = {"match", feature_matchers(), "nearest_feature", "", false};
  slots.reject = {"reject", correspondence_rejectors(), "median", "", true};
  slots.coarse = {"coarse", hypothesis_generators(), "surface_ransac", "", true};
  slots.refine_coarse = {"refine_coarse", pose_refiners(), "icp", kCoarseRefinement, false};
  slots.refine = {"refine", pose_refiners(), "icp", kFineRefinement, false};
  return slots;
}

ConfigTable slot_defaults(std::string_view defaults, std::string_view method) {
  const ConfigTable all = parse_config(defaults, "defaults");
  const ConfigValue* found = all.find(method);
  if (found == nullptr) return ConfigTable("", std::string(method), 0);
  return std::get<std::vector<ConfigTable>>(found->data).front();
}

}  // namespace grapnel
