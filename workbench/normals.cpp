#include "pipeline/preprocess/normals.h"

#include <algorithm>
#include <iostream>
#include <limits>
#include <string>
#include <vector>

#include "base/cloud_file.h"
#include "workbench/commands.h"
#include "workbench/input.h"
#include "workbench/options.h"
#include "workbench/stage_run.h"
#include "workbench/surfaces.h"

namespace grapnel {
namespace {

/// Takes "method=NAME" out of the overrides.
std::string take_method(std::vector<std::string>& overrides, const std::string& fallback) {
  std::string method = fallback;
  std::erase_if(overrides, [&](const std::string& assignment) {
    if (!assignment.starts_with("method=")) return false;
    method = assignment.substr(std::string("method=").size());
    return true;
  });
  return method;
}

/// The input as it came, with normals; NaN where the method found none.
CloudData with_normals(const Input& input, const StoredSurface& stored,
                       std::span<const float> curvature) {
  CloudData cloud = cloud_of(input);
  const std::vector<float> none(cloud.size(), std::numeric_limits<float>::quiet_NaN());
  cloud.nx = cloud.ny = cloud.nz = none;
  if (!curvature.empty()) cloud.curvature = none;
  const Surface& surface = stored.surface;
  for (std::size_t i = 0; i < surface.size; ++i) {
    if (!surface.has_normal(i)) continue;
    const std::size_t to = stored.input_of[i];
    cloud.nx[to] = surface.nx[i];
    cloud.ny[to] = surface.ny[i];
    cloud.nz[to] = surface.nz[i];
    if (!curvature.empty()) cloud.curvature[to] = curvature[i];
  }
  return cloud;
}

}  // namespace

int run_normals(std::span<const std::string> args) {
  std::string file;
  std::string output;
  std::string camera;
  std::string viewpoint;
  std::vector<std::string> overrides;
  Options options("normals", "Estimates a normal for every point of a cloud.");
  options.positional("CLOUD", file, "cloud, PNG with --camera, or RECORDING#N");
  options.repeated("--set", overrides,
                   "radius_m=, k=, method= (" + method_names(normal_estimators()) +
                       ") and the method's other keys; repeatable");
  options.value("--viewpoint", viewpoint,
                "x,y,z in metres that normals point to; without it the camera of a grid, the "
                "file's viewpoint, the origin where all points lie before it along +z, else away "
                "from the cloud's centre");
  options.value("--camera", camera, "camera.toml of a bare PNG");
  options.required("-o,--output", output, "OUT.pcd or OUT.ply, points as in CLOUD");
  if (!options.parse(args)) return 0;

  const std::string method = take_method(overrides, "pca");
  const Input input = load_input(file, {camera, ""});
  const std::unique_ptr<StoredSurface> stored = make_surface(input);
  Surface& surface = stored->surface;
  for (const std::span<float>& plane : {surface.nx, surface.ny, surface.nz}) {
    std::fill(plane.begin(), plane.end(), 0.0F);
  }
  surface.spacing_m = measured_spacing_m(surface);
  if (!viewpoint.empty()) {
    const std::vector<double> from = parse_numbers(viewpoint, 3, "--viewpoint");
    surface.viewpoint = Vec3d(from[0], from[1], from[2]).cast<float>();
    surface.has_viewpoint = true;
  }
  LoadedStage<NormalEstimator> stage(normal_estimators(), method, overrides,
                                     limits_for(surface.size));
  require_ok(stage->estimate(surface), method);
  const auto* planes = dynamic_cast<const PcaNormals*>(&*stage);
  const CloudData cloud = with_normals(
      input, *stored, planes != nullptr ? planes->curvature() : std::span<const float>{});
  write_cloud(output, cloud);
  std::size_t found = 0;
  for (std::size_t i = 0; i < surface.size; ++i) found += surface.has_normal(i) ? 1 : 0;
  std::cout << output << ": " << found << " normals of " << surface.size << " points\n";
  return 0;
}

}  // namespace grapnel
