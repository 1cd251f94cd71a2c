#pragma once

#include <cstdint>

#include "base/field.h"
#include "base/geometry.h"
#include "pipeline/preprocess/plane_search.h"
#include "pipeline/preprocess/working_depth.h"
#include "pipeline/report.h"
#include "pipeline/surface.h"

namespace grapnel {

/// A grasp from the top surface of an object that no model fits, as a sack that lies otherwise than
/// it was taught. Off unless a preset turns it on.
struct SurfaceGraspParams {
  bool enabled = false;
  double radius_m = 0.05;  ///< of the footprint that has to be flat: the gripper's cup
  double min_filled = 0.95;
  double max_deviation_m = 0.006;
  double max_slope_rad = 0.45;
  double min_height_m = 0.03;
  double max_height_ratio = 1.8;
  double min_size_ratio = 0.5;
  double max_size_ratio = 1.4;
};
[[nodiscard]] FieldTable surface_grasp_fields() noexcept;

/// One object of a frame with what it is compared with.
struct GraspScene {
  const WorkingDepth* work = nullptr;
  std::uint8_t label = 0;            ///< of the object's pixels
  const Surface* surface = nullptr;  ///< the object, thinned, with normals
  const DepthPlane* belt = nullptr;  ///< nullptr = not known
  bool whole = false;                ///< no pixel lies on the image's edge
  double area_m2 = 0.0;              ///< projected
  double model_area_m2 = 0.0;        ///< of the model's largest view
  double model_thickness_m = 0.0;    ///< the model's least extent
};

/// Finds the highest footprint that is filled by the object, flat and not too steep: the grasp's
/// origin lies on the plane through the readings there, z points into the object, x along its
/// length (of the two ways the one to the image's right). Fills `report` with it and code
/// SurfaceGrasp, or adds the reasons why there is none. O(points × footprint's pixels, at most some
/// hundred).
void grasp_surface(const GraspScene& scene, const SurfaceGraspParams& params,
                   RegistrationReport& report) noexcept;

/// Least side of the bounding box. O(points).
[[nodiscard]] double least_extent_m(const Surface& model) noexcept;

}  // namespace grapnel
