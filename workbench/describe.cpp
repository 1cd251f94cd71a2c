#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "base/input_error.h"
#include "workbench/commands.h"
#include "workbench/input.h"
#include "workbench/keypoints.h"
#include "workbench/options.h"
#include "workbench/stage_run.h"

namespace grapnel {
namespace {

/// The surface's points with these indices in the input. Throws InputError where one has no
/// reading.
std::vector<Keypoint> keypoints_at(const StoredSurface& stored, const std::string& at) {
  std::vector<Keypoint> keypoints;
  for (const std::size_t index : parse_indices(at, "--at")) {
    const auto found = std::lower_bound(stored.input_of.begin(), stored.input_of.end(), index);
    if (found == stored.input_of.end() || *found != index) {
      throw InputError("--at " + std::to_string(index) +
                       ": the cloud has no such point or no "
                       "reading there");
    }
    Keypoint keypoint;
    keypoint.point = static_cast<std::int32_t>(found - stored.input_of.begin());
    keypoints.push_back(keypoint);
  }
  return keypoints;
}

void write_csv(const std::string& file, const StoredSurface& stored,
               const std::vector<Keypoint>& keypoints, const FeatureMatrix& features) {
  std::ofstream stream(file, std::ios::binary);
  for (std::size_t row = 0; row < features.rows; ++row) {
    stream << stored.input_of[static_cast<std::size_t>(keypoints[row].point)];
    for (const float bin : features.row(row)) {
      char text[32];
      std::snprintf(text, sizeof text, ",%.9g", static_cast<double>(bin));
      stream << text;
    }
    stream << "\n";
  }
  stream.flush();
  if (!stream) throw InputError(file + ": can't be written");
}

}  // namespace

int run_describe(std::span<const std::string> args) {
  std::string file;
  std::string descriptor;
  std::string at;
  std::string detector;
  std::string camera;
  std::string csv;
  std::string mode = "fast";
  std::vector<std::string> overrides;
  Options options("describe", "Describes points of a cloud by their surroundings.");
  options.positional("CLOUD", file, "cloud, PNG with --camera, or RECORDING#N");
  options.required("--descriptor", descriptor, method_names(descriptor_estimators()));
  options.value("--at", at, "indices of points in CLOUD, as 0,12 or 0-90:10");
  options.value("--keypoints", detector,
                "a detector with its defaults instead: " + method_names(keypoint_detectors()));
  options.repeated("--set", overrides, "key=value over the descriptor's defaults; repeatable");
  options.value("--mode", mode, "fast, or reference: plain loops in double");
  options.value("--camera", camera, "camera.toml of a bare PNG");
  options.required("--csv", csv, "file to write: a row a point, its index, then the bins");
  if (!options.parse(args)) return 0;

  overrides = with_mode(descriptor_estimators(), descriptor, overrides, mode);
  if (at.empty() == detector.empty()) {
    throw InputError("one of --at and --keypoints is needed (see grapnel describe --help)");
  }
  const Input input = load_input(file, {camera, ""});
  const std::unique_ptr<StoredSurface> stored = make_surface(input);
  Surface& surface = stored->surface;
  surface.spacing_m = measured_spacing_m(surface);
  const std::vector<Keypoint> keypoints =
      at.empty() ? detect_keypoints(surface, detector, {}) : keypoints_at(*stored, at);
  ensure_normals(surface);
  LoadedStage<DescriptorEstimator> stage(descriptor_estimators(), descriptor, overrides,
                                         limits_for(std::max(surface.size, keypoints.size())));
  FeatureMatrix features;
  const Block memory = carve([&](Arena& arena) {
    features.reserve(arena, std::max<std::size_t>(keypoints.size(), 1), stage->dimension());
  });
  require_ok(stage->describe(surface, keypoints, features), descriptor);
  write_csv(csv, *stored, keypoints, features);
  std::cout << csv << ": " << features.rows << " rows of " << features.dimension << " bins\n";
  return 0;
}

}  // namespace grapnel
