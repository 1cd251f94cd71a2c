#pragma once

#include <memory>
#include <string>
#include <vector>

#include "workbench/input.h"
#include "workbench/surfaces.h"
#include "workbench/teach/fusion.h"

namespace grapnel {

/// What stands beside a list of views.
struct ViewOptions {
  InputOptions input;              ///< of bare PNGs
  std::string frames;              ///< of recordings, as 0,2,4 or 0-16:2; "" = all
  std::vector<std::string> masks;  ///< black = leave out: none, one for all frames or one a frame
  Box crop;                        ///< in the view's own frame: what lies outside is left out
};

/// One partial view, ready to be registered.
struct View {
  std::string name;
  Input input;  ///< masked and cropped
  std::unique_ptr<StoredSurface> surface;
};

/// Reads views: clouds, PNGs, RECORDING#N, and recordings (also .oni files and fakenect folders),
/// which give one view a frame. Throws
/// InputError, also when a view has no reading left.
[[nodiscard]] std::vector<View> load_views(const std::vector<std::string>& names,
                                           const ViewOptions& options);

/// Points of a view that a model can be made of, in the view's frame, weighted by 1/sigma². A
/// cloud's normals are estimated where it has none, toward its viewpoint or else outward.
[[nodiscard]] std::vector<SurfaceSample> view_samples(const View& view);

/// Every n-th point of a view, so that at most `count` remain, metres.
[[nodiscard]] std::vector<Vec3f> sampled_points(const View& view, std::size_t count);

}  // namespace grapnel
