#include "workbench/stage_run.h"

#include <algorithm>

#include "base/code.h"
#include "base/input_error.h"

namespace grapnel {

void require_ok(const Status& status, const std::string& what) {
  if (status) return;
  const Error& error = status.error();
  throw InputError(what + ": " + std::string(describe(error.code).text) + " (code " +
                   std::to_string(static_cast<unsigned>(error.code)) + ")");
}

Limits limits_for(std::size_t points) {
  const std::size_t count = std::max<std::size_t>(points, 16);
  Limits limits;
  limits.max_points = count;
  limits.max_input_points = count;
  limits.max_model_points = count;
  limits.max_keypoints = count;
  limits.max_correspondences = count;
  return limits;
}

bool add_engine(FieldTable fields, const std::string& mode) {
  if (mode != "fast" && mode != "reference") {
    throw InputError("--mode " + mode + ": \"fast\" and \"reference\" are allowed");
  }
  const bool has = std::any_of(fields.begin(), fields.end(),
                               [](const Field& field) { return field.name == "engine"; });
  if (!has && mode != "fast") {
    throw InputError("--mode " + mode + ": this method has but one engine, \"fast\"");
  }
  return has;
}

void ensure_normals(Surface& surface) {
  for (std::size_t i = 0; i < surface.size; ++i) {
    if (surface.has_normal(i)) return;
  }
  LoadedStage<NormalEstimator> normals(normal_estimators(), "pca", {}, limits_for(surface.size));
  require_ok(normals->estimate(surface), "normals");
}

}  // namespace grapnel
