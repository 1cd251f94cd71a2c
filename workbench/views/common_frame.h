#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "workbench/answer.h"
#include "workbench/pose_graph/pose_graph.h"
#include "workbench/views/view_set.h"

namespace grapnel {

/// How views are brought into one frame.
struct CommonFrameOptions {
  std::string preset = "pair";
  std::vector<std::string> overrides;  ///< key=value over the preset's
  std::size_t reach = 0;               ///< only views at most this far apart in the list; 0 = all
  std::size_t jobs = 1;                ///< pairs registered at once; the result does not depend
  bool joint = true;                   ///< fit all of a camera's views at once after the graph
  bool fit_focal = true;               ///< and with them one factor on the focal lengths
  double shared_error_m = 0.0;  ///< 1-σ of errors that a view's readings share; 0 = from its size
};

/// What became of a pair of views.
enum class EdgeFate : std::uint8_t {
  Tree,         ///< carries a view, and agrees with the rest
  Loop,         ///< confirms
  SwitchedOff,  ///< accepted by itself, but contradicted by the others
  Rejected,     ///< by its own verdict
};

/// One pair of views that was tried: `source` carried onto `target`.
struct ViewEdge {
  std::size_t source = 0;
  std::size_t target = 0;
  Answer answer;
  EdgeFate fate = EdgeFate::Rejected;
  double line = 0.0;            ///< line process, 1 = fully believed; 0 where rejected
  double residual_sigma = 0.0;  ///< of the final poses, root of the squared length
};

/// The pose of one view.
struct PlacedView {
  bool connected = false;  ///< to the first view
  bool confirmed = false;  ///< by a loop: more than one way leads there, and they agree
  std::size_t part = 0;    ///< 0 = the first view's
  Pose part_from_view = Pose::Identity();  ///< part 0: first_from_view
};

/// How well loops of three kept edges close: mean displacement of a view's points after the way
/// around.
struct LoopReport {
  std::size_t loops = 0;
  double rms_m = 0.0;
  double max_m = 0.0;
  double max_rad = 0.0;
};

/// What the fit of all views at once found. Only of views that have a camera.
struct JointReport {
  bool done = false;
  double focal_factor = 1.0;  ///< the views fit best with focal lengths times this
  double focal_sigma = 0.0;
  double rms_m = 0.0;  ///< point-to-plane, where views overlap
  std::size_t partners = 0;
};

/// Views in one frame.
struct CommonFrame {
  std::vector<PlacedView> views;
  std::vector<ViewEdge> edges;
  LoopReport loops;
  JointReport joint;
  int iterations = 0;
  std::size_t parts = 0;

  [[nodiscard]] bool complete() const noexcept { return parts <= 1; }
};

/// Registers the pairs without a guess, connects the accepted ones and fits a pose graph with
/// switchable edges. Throws InputError on a bad preset. O(views² × a registration).
[[nodiscard]] CommonFrame bring_together(const std::vector<View>& views,
                                         const CommonFrameOptions& options);

}  // namespace grapnel
