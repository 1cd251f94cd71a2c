#pragma once

#include <span>

#include "base/arena.h"
#include "base/geometry.h"
#include "pipeline/judge/depth_view.h"
#include "pipeline/judge/model_render.h"
#include "pipeline/surface.h"

namespace grapnel {

/// What the image shows beside a part's outline, as heights above the belt's plane.
struct GroundBeside {
  double level_m = 0.0;  ///< the height at which most of it lies
  double share = 0.0;    ///< share of the unhidden outline beside which it lies at that height
  /// Share of the unhidden outline where the image shows why the part may end above that level:
  /// something at the height of its underside, something that meets its side in a hollow edge (what
  /// it stands on or is held by), or the ground seen below its lower edge (it hangs).
  double borne = 0.0;
};

/// A part whose sides are not in sight may be of any height: its pose claims where it ends below,
/// and only what lies beside it can contradict.
class GroundSearch {
 public:
  void reserve(Arena& arena, std::size_t max_contour);

  /// `render` holds the model at the pose, contour included; `view` has a belt. Heights within
  /// `tolerance_m` of each other are one level; `lowest_m` and `highest_m` are the part's.
  /// O(contour log contour).
  GroundBeside look(const Surface& model, const Pose& camera_from_model, const ModelRender& render,
                    const DepthView& view, const EdgeMap& edges, double lowest_m, double highest_m,
                    double tolerance_m) noexcept;

 private:
  /// A point of the unhidden outline and the first reading beside it.
  struct Place {
    Vec3f point;   ///< of the part
    Vec3f normal;  ///< of its surface there
    Vec3f beside;  ///< the reading
    float height_m = 0.0F;
    float out_u = 0.0F;  ///< unit, out of the silhouette
    float out_v = 0.0F;
    bool met = false;    ///< a depth edge meets the outline here
    bool found = false;  ///< there is a reading
  };
  void collect(const Surface& model, const Pose& camera_from_model, const ModelRender& render,
               const DepthView& view, const EdgeMap& edges) noexcept;
  /// The first reading beyond the outline; false where the part itself goes on there.
  static bool look_beside(const ModelRender& render, const DepthView& view,
                          const ContourPoint& point, Place& place) noexcept;
  void find_level(double tolerance_m, GroundBeside& ground) noexcept;
  [[nodiscard]] static bool borne_at(const Place& place, const DepthView& view, double level_m,
                                     double lowest_m, double highest_m,
                                     double tolerance_m) noexcept;

  std::span<Place> places_;
  std::span<float> heights_;
  std::size_t size_ = 0;
};

}  // namespace grapnel
