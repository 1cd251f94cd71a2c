#include <algorithm>
#include <string>
#include <vector>

#include "base/input_error.h"
#include "base/rng.h"
#include "workbench/commands.h"
#include "workbench/feature_csv.h"
#include "workbench/input.h"
#include "workbench/options.h"
#include "workbench/stage_run.h"
#include "workbench/surfaces.h"

namespace grapnel {
namespace {

/// The surface's point with this index in the input. Throws InputError where it has no reading.
Keypoint keypoint_at(const StoredSurface& stored, std::int32_t index, const std::string& name) {
  const auto wanted = static_cast<std::uint32_t>(index);
  const auto found = std::lower_bound(stored.input_of.begin(), stored.input_of.end(), wanted);
  if (found == stored.input_of.end() || *found != wanted) {
    throw InputError(name + ": has no point " + std::to_string(index) + " with a reading");
  }
  Keypoint keypoint;
  keypoint.point = static_cast<std::int32_t>(found - stored.input_of.begin());
  return keypoint;
}

}  // namespace

int run_reject(std::span<const std::string> args) {
  std::string source_name;
  std::string target_name;
  std::string pairs_file;
  std::string method;
  std::int64_t seed = 1;
  std::vector<std::string> overrides;
  bool json = false;
  Options options("reject", "Removes pairs that can't belong to one rigid motion.");
  options.positional("SOURCE", source_name, "cloud that the pairs' source indices refer to");
  options.positional("TARGET", target_name, "cloud that the pairs' target indices refer to");
  options.required("--correspondences", pairs_file,
                   "JSON of grapnel match, or source,target,distance");
  options.required("--method", method, method_names(correspondence_rejectors()));
  options.repeated("--set", overrides, "key=value over the method's defaults; repeatable");
  options.integer("--seed", seed, 0, 4294967295, "of methods that draw random numbers");
  options.flag("--json", json, "one JSON object on stdout");
  if (!options.parse(args)) return 0;

  const std::unique_ptr<StoredSurface> source = make_surface(load_input(source_name, {}));
  const std::unique_ptr<StoredSurface> target = make_surface(load_input(target_name, {}));
  source->surface.spacing_m = measured_spacing_m(source->surface);
  target->surface.spacing_m = measured_spacing_m(target->surface);
  const std::vector<Correspondence> given = load_correspondences(pairs_file);
  std::vector<Keypoint> source_keypoints;
  std::vector<Keypoint> target_keypoints;
  std::vector<Correspondence> storage(given.size());
  Correspondences pairs{std::span<Correspondence>(storage)};
  for (std::size_t i = 0; i < given.size(); ++i) {
    source_keypoints.push_back(keypoint_at(*source, given[i].source, source_name));
    target_keypoints.push_back(keypoint_at(*target, given[i].target, target_name));
    pairs.push_back(
        {static_cast<std::int32_t>(i), static_cast<std::int32_t>(i), given[i].distance});
  }
  LoadedStage<CorrespondenceRejector> stage(correspondence_rejectors(), method, overrides,
                                            limits_for(given.size()));
  const PairView view = {&source->surface, &target->surface, source_keypoints, target_keypoints};
  Rng rng(static_cast<std::uint64_t>(seed));
  const Status status = stage->reject(view, pairs, rng);
  if (!status && status.error().code != Code::NoConsensus &&
      status.error().code != Code::TooFewCorrespondences) {
    require_ok(status, method);
  }
  if (!status) pairs.clear();
  std::vector<Correspondence> kept;
  for (const Correspondence& pair : pairs)
    kept.push_back(given[static_cast<std::size_t>(pair.source)]);
  print_correspondences(kept, json);
  return status ? 0 : 1;
}

}  // namespace grapnel
