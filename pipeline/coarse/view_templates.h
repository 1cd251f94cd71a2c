#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "base/field.h"
#include "base/fixed_list.h"
#include "pipeline/coarse/pose_score.h"
#include "pipeline/features.h"
#include "pipeline/surface.h"

namespace grapnel {

struct ViewTemplateParams {
  std::size_t views = 160;  ///< directions a model may be seen from
  std::size_t turns = 24;   ///< about each of them
  std::size_t slides = 0;   ///< shifts toward the surface, for objects partly missing
  std::size_t quick_samples = 48;
  std::size_t finalists = 160;  ///< rated again with every sample
};
[[nodiscard]] FieldTable view_template_fields() noexcept;

/// How a model looks from one side: the middle of what is visible from there.
struct ViewTemplate {
  Vec3f toward_camera = Vec3f::Zero();  ///< unit, model frame
  Vec3f middle = Vec3f::Zero();  ///< of the visible surface, each piece by its projected area
  float visible_area_m2 = 0.0F;  ///< projected
};

/// Proposes poses without any feature: for each of a fixed set of views and turns the model is put
/// where the middle of its visible surface meets the middle of the measured object. Works for
/// plain shapes that stand alone; needs the object cut out.
class ViewTemplates {
 public:
  void reserve(Arena& arena, const ViewTemplateParams& params);
  /// Load time: takes memory from the heap for its own use. O(views × points).
  void build(const Surface& model, const ViewTemplateParams& params);

  /// Rates every view and turn against the object and adds the best to `hypotheses`, best first.
  void propose(const Vec3d& object_middle, const PoseScore& score, Hypotheses& hypotheses) noexcept;

  /// Smallest and largest projected area a view shows; 0 without views.
  [[nodiscard]] float least_area_m2() const noexcept;
  [[nodiscard]] float most_area_m2() const noexcept;
  [[nodiscard]] std::span<const ViewTemplate> views() const noexcept { return views_; }

 private:
  /// Directions across the ray, after a turn about it.
  struct Turn {
    Vec3d first = Vec3d::UnitX();
    Vec3d second = Vec3d::UnitY();
  };
  /// An object's middle, the ray to it and the turns about that.
  void set_out(const Vec3d& object_middle) noexcept;
  /// Fills by_turn_ with the poses at which the view's middle meets the object's.
  void place(const ViewTemplate& view) noexcept;

  /// Enters the hypothesis, or what it is after the slides, among the finalists if it is one.
  void keep_slid(Hypothesis hypothesis, const PoseScore& score) noexcept;
  [[nodiscard]] bool full() const noexcept { return rank_.full(); }

  std::span<ViewTemplate> views_;
  std::span<Hypothesis> finalists_;  // each stays in its place…
  FixedList<std::uint16_t> rank_;    // …and these are their places, best first
  std::span<Hypothesis> by_turn_;
  std::span<Turn> turns_;
  Vec3d object_middle_ = Vec3d::Zero();
  Vec3d toward_camera_ = Vec3d::UnitZ();
  double turn_step_ = 0.0;
  ViewTemplateParams params_;
};

}  // namespace grapnel
