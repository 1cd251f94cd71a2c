#include "workbench/views/view_model.h"

#include <algorithm>

#include "workbench/views/joint_fit.h"

namespace grapnel {

std::vector<TaughtView> taught_views(const std::vector<View>& views, const CommonFrame& frame) {
  std::vector<TaughtView> taught;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!frame.views[i].connected) continue;
    taught.push_back({view_samples(views[i]), frame.views[i].part_from_view});
    apply_focal_factor(frame.joint.focal_factor, taught.back().samples);
  }
  return taught;
}

double views_sampling_m(const std::vector<View>& views) {
  std::vector<double> sampling_m;
  for (const View& view : views) sampling_m.push_back(measured_spacing_m(view.surface->surface));
  if (sampling_m.empty()) return 0.001;
  const auto middle = sampling_m.begin() + static_cast<std::ptrdiff_t>(sampling_m.size() / 2);
  std::nth_element(sampling_m.begin(), middle, sampling_m.end());
  return *middle > 0.0 ? *middle : 0.001;
}

}  // namespace grapnel
