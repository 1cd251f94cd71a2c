#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/cloud_file.h"
#include "workbench/commands.h"
#include "workbench/depth_filter.h"
#include "workbench/input.h"
#include "workbench/options.h"
#include "workbench/stage_run.h"
#include "workbench/surfaces.h"

namespace grapnel {
namespace {

CloudData cloud_of_surface(const Surface& surface) {
  CloudData cloud;
  const auto copy = [&](std::span<const float> values) {
    return std::vector<float>(values.begin(),
                              values.begin() + static_cast<std::ptrdiff_t>(surface.size));
  };
  bool normals = false;
  bool intensity = false;
  for (std::size_t i = 0; i < surface.size; ++i) {
    normals |= surface.has_normal(i);
    intensity |= surface.intensity[i] != 0.0F;
  }
  cloud.x = copy(surface.x);
  cloud.y = copy(surface.y);
  cloud.z = copy(surface.z);
  if (normals) {
    cloud.nx = copy(surface.nx);
    cloud.ny = copy(surface.ny);
    cloud.nz = copy(surface.nz);
  }
  if (intensity) cloud.intensity = copy(surface.intensity);
  cloud.width = static_cast<int>(surface.size);
  return cloud;
}

/// What one filter did.
struct Filtered {
  CloudData cloud;
  std::size_t before = 0;
  std::size_t after = 0;
};

Filtered filter_grid(const Input& input, const std::string& method,
                     const std::vector<std::string>& overrides) {
  Filtered filtered;
  filtered.cloud = cloud_of(input);
  filtered.before = points_of(input).size();
  filtered.after = filtered.before - filter_depth(filtered.cloud, method, overrides);
  return filtered;
}

Filtered filter_surface(const Input& input, const std::string& method,
                        const std::vector<std::string>& overrides) {
  const std::unique_ptr<StoredSurface> stored = make_surface(input);
  Filtered filtered;
  stored->surface.spacing_m = measured_spacing_m(stored->surface);
  filtered.before = stored->surface.size;
  LoadedStage<CloudFilter> filter(cloud_filters(), method, overrides, limits_for(filtered.before));
  Result<std::size_t> removed = filter->apply(stored->surface);
  if (!removed && removed.error().code == Code::TooFewPoints) {
    // Some sample by the points' normals, which the file may lack.
    ensure_normals(stored->surface);
    removed = filter->apply(stored->surface);
  }
  if (!removed) require_ok(removed.error(), method);
  filtered.after = stored->surface.size;
  filtered.cloud = cloud_of_surface(stored->surface);
  return filtered;
}

}  // namespace

int run_filter(std::span<const std::string> args) {
  std::string file;
  std::string method;
  std::string output;
  std::string camera;
  std::vector<std::string> overrides;
  bool json = false;
  Options options("filter", "Removes or merges points of a cloud.");
  options.positional("CLOUD", file, "cloud, PNG with --camera, or RECORDING#N");
  options.required("--method", method,
                   method_names(cloud_filters()) + ", " + kDepthFilterNames + " (organised)");
  options.repeated("--set", overrides, "key=value over the method's defaults; repeatable");
  options.value("--camera", camera, "camera.toml of a bare PNG");
  options.required("-o,--output", output, "OUT.pcd or OUT.ply");
  options.flag("--json", json, "one JSON object on stdout");
  if (!options.parse(args)) return 0;

  const Input input = load_input(file, {camera, ""});
  const Filtered filtered = is_depth_filter(method) ? filter_grid(input, method, overrides)
                                                    : filter_surface(input, method, overrides);
  write_cloud(output, filtered.cloud);
  if (json) {
    const nlohmann::ordered_json answer = {{"method", method},
                                           {"input_points", filtered.before},
                                           {"output_points", filtered.after},
                                           {"removed", filtered.before - filtered.after}};
    std::cout << answer.dump(2) << "\n";
  } else {
    std::cout << output << ": " << filtered.after << " of " << filtered.before << " points\n";
  }
  return 0;
}

}  // namespace grapnel
