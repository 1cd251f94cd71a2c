#include "tests/example/sack_steps.h"

#include <ctime>
#include <filesystem>

#include "pipeline/registrar.h"
#include "workbench/stage_run.h"

namespace grapnel::example {
namespace {

constexpr double kLeaf_m = 0.006;

double thread_ms() {
  std::timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

std::unique_ptr<StoredSurface> thinned(const SackView& view) {
  std::unique_ptr<StoredSurface> stored = make_surface(view.frame);
  LoadedStage<CloudFilter> voxel(cloud_filters(), "voxel", {"leaf_m=" + std::to_string(kLeaf_m)},
                                 limits_for(stored->surface.size));
  const Result<std::size_t> removed = voxel->apply(stored->surface);
  if (!removed.ok()) require_ok(removed.error(), "voxel");
  ensure_normals(stored->surface);
  return stored;
}

std::vector<Keypoint> detected(const Surface& surface, const std::string& detector) {
  LoadedStage<KeypointDetector> stage(keypoint_detectors(), detector, {}, limits_for(surface.size));
  std::vector<Keypoint> storage(surface.size);
  KeypointSet keypoints{std::span<Keypoint>(storage)};
  require_ok(stage->detect(surface, keypoints), detector);
  storage.resize(keypoints.size());
  return storage;
}

/// FPFH of the keypoints, with its memory.
struct Described {
  FeatureMatrix features;
  Block block;

  Described(const Surface& surface, const std::vector<Keypoint>& keypoints)
      : block(carve([&](Arena& arena) { features.reserve(arena, keypoints.size() + 1, 33); })) {
    LoadedStage<DescriptorEstimator> stage(descriptor_estimators(), "fpfh", {},
                                           limits_for(surface.size));
    require_ok(stage->describe(surface, keypoints, features), "fpfh");
  }
};

Vec3d place(const Surface& surface, const Keypoint& keypoint) {
  return (surface.point(static_cast<std::size_t>(keypoint.point)) + keypoint.offset_m)
      .cast<double>();
}

void match_and_reject(const std::string& rejector, Steps& steps) {
  const Described source(steps.source->surface, steps.source_keypoints);
  const Described target(steps.target->surface, steps.target_keypoints);
  Limits limits = limits_for(steps.source->surface.size);
  limits.descriptor_dimension = 33;
  LoadedStage<FeatureMatcher> matcher(feature_matchers(), "nearest_feature", {}, limits);
  std::vector<Correspondence> storage(steps.source_keypoints.size());
  Correspondences pairs{std::span<Correspondence>(storage)};
  require_ok(matcher->match(source.features, target.features, pairs), "match");
  steps.matched.assign(pairs.begin(), pairs.end());
  LoadedStage<CorrespondenceRejector> stage(correspondence_rejectors(), rejector, {}, limits);
  const PairView view{&steps.source->surface, &steps.target->surface, steps.source_keypoints,
                      steps.target_keypoints};
  Rng rng(1);
  if (!stage->reject(view, pairs, rng).ok()) pairs.clear();
  steps.kept.assign(pairs.begin(), pairs.end());
}

}  // namespace

Steps take_steps(const SackPair& pair, const std::string& detector, const std::string& rejector) {
  Steps steps;
  steps.source = thinned(pair.source);
  steps.target = thinned(pair.target);
  steps.source_keypoints = detected(steps.source->surface, detector);
  steps.target_keypoints = detected(steps.target->surface, detector);
  match_and_reject(rejector, steps);
  return steps;
}

std::vector<bool> found_again(const Steps& steps, const SackPair& pair) {
  std::vector<bool> again;
  for (const Keypoint& keypoint : steps.source_keypoints) {
    const Vec3d there = pair.target_from_source * place(steps.source->surface, keypoint);
    bool found = false;
    for (const Keypoint& other : steps.target_keypoints) {
      found = found || (place(steps.target->surface, other) - there).norm() < kSame_m;
    }
    again.push_back(found);
  }
  return again;
}

bool is_right(const Correspondence& correspondence, const Steps& steps, const SackPair& pair) {
  const Keypoint& s = steps.source_keypoints[static_cast<std::size_t>(correspondence.source)];
  const Keypoint& t = steps.target_keypoints[static_cast<std::size_t>(correspondence.target)];
  return (pair.target_from_source * place(steps.source->surface, s) -
          place(steps.target->surface, t))
             .norm() < kSame_m;
}

std::vector<Combination> every_combination() {
  struct Refiner {
    const char* name;
    std::vector<std::string> overrides;
  };
  const Refiner refiners[] = {
      {"ICP, point to plane", {"refine.method=icp"}},
      {"ICP, point to point", {"refine.method=icp", "refine.metric=point_to_point"}},
      {"generalized ICP", {"refine.method=generalized_icp"}},
  };
  std::vector<Combination> list;
  for (const char* const detector : kDetectors) {
    for (const char* const rejector : {"median", "ransac", "graph"}) {
      for (const char* const generator : {"surface_ransac", "svd"}) {
        for (const Refiner& refiner : refiners) {
          Combination combination{detector, rejector, generator, refiner.name, refiner.overrides};
          combination.overrides.push_back(std::string("keypoints.method=") + detector);
          combination.overrides.push_back(std::string("reject.method=") + rejector);
          combination.overrides.push_back(std::string("coarse.method=") + generator);
          combination.overrides.emplace_back("match.top=1");
          list.push_back(std::move(combination));
        }
      }
    }
  }
  return list;
}

std::vector<Outcome> register_pairs(const Combination& combination,
                                    std::span<const SackPair> pairs) {
  const std::filesystem::path config = std::filesystem::path(GRAPNEL_SOURCE_DIR) / "config";
  const auto registrar = Registrar::create(load_preset(find_preset(config / "presets", "pair"),
                                                       config / "models", combination.overrides));
  std::vector<Outcome> outcomes;
  for (const SackPair& pair : pairs) {
    Outcome outcome;
    const double before_ms = thread_ms();
    const Result<RegistrationReports> answer =
        registrar->register_pair(pair.source.surface->surface, pair.target.surface->surface, {});
    outcome.ms = thread_ms() - before_ms;
    if (answer.ok() && answer.value().objects.size() == 1) {
      const RegistrationReport& report = answer.value().objects[0];
      outcome.has_pose = report.has_pose;
      outcome.accepted = report.accepted;
      outcome.target_from_source = report.target_from_source;
      if (outcome.has_pose) outcome.error = error_of(report.target_from_source, pair);
    }
    outcomes.push_back(outcome);
  }
  return outcomes;
}

}  // namespace grapnel::example
