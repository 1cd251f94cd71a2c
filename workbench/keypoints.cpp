#include "workbench/keypoints.h"

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "workbench/commands.h"
#include "workbench/input.h"
#include "workbench/options.h"
#include "workbench/stage_run.h"

namespace grapnel {

std::vector<Keypoint> detect_keypoints(Surface& surface, const std::string& detector,
                                       const std::vector<std::string>& overrides) {
  // A picture of few and scattered points still has all its pixels.
  const auto pixels =
      static_cast<std::size_t>(surface.grid.width) * static_cast<std::size_t>(surface.grid.height);
  LoadedStage<KeypointDetector> stage(keypoint_detectors(), detector, overrides,
                                      limits_for(std::max(surface.size, pixels)));
  ensure_normals(surface);
  std::vector<Keypoint> storage(surface.size);
  KeypointSet keypoints{std::span<Keypoint>(storage)};
  require_ok(stage->detect(surface, keypoints), detector);
  storage.resize(keypoints.size());
  return storage;
}

int run_keypoints(std::span<const std::string> args) {
  std::string file;
  std::string detector;
  std::string camera;
  std::string mode = "fast";
  std::vector<std::string> overrides;
  bool json = false;
  Options options("keypoints", "Finds interest points of a cloud.");
  options.positional("CLOUD", file, "cloud, PNG with --camera, or RECORDING#N");
  options.required("--detector", detector, method_names(keypoint_detectors()));
  options.repeated("--set", overrides, "key=value over the detector's defaults; repeatable");
  options.value("--mode", mode, "fast, or reference: plain loops in double");
  options.value("--camera", camera, "camera.toml of a bare PNG");
  options.flag("--json", json, "one JSON object on stdout");
  if (!options.parse(args)) return 0;

  overrides = with_mode(keypoint_detectors(), detector, overrides, mode);
  const Input input = load_input(file, {camera, ""});
  const std::unique_ptr<StoredSurface> stored = make_surface(input);
  stored->surface.spacing_m = measured_spacing_m(stored->surface);
  const std::vector<Keypoint> keypoints = detect_keypoints(stored->surface, detector, overrides);
  if (!json) std::cout << keypoints.size() << " keypoints\n";
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Keypoint& keypoint : keypoints) {
    const auto point_i = static_cast<std::size_t>(keypoint.point);
    const Vec3f p = stored->surface.point(point_i) + keypoint.offset_m;
    if (json) {
      list.push_back({{"index", stored->input_of[point_i]},
                      {"x", p.x()},
                      {"y", p.y()},
                      {"z", p.z()},
                      {"score", keypoint.score},
                      {"scale", keypoint.scale_m}});
    } else {
      std::cout << stored->input_of[point_i] << " " << p.x() << " " << p.y() << " " << p.z() << " "
                << keypoint.score << "\n";
    }
  }
  if (json) {
    const nlohmann::ordered_json answer = {
        {"detector", detector}, {"points", stored->surface.size}, {"keypoints", list}};
    std::cout << answer.dump(2) << "\n";
  }
  return 0;
}

}  // namespace grapnel
