#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "base/input_error.h"
#include "pipeline/preprocess/principal_curvature.h"
#include "workbench/commands.h"
#include "workbench/input.h"
#include "workbench/options.h"
#include "workbench/stage_run.h"
#include "workbench/surfaces.h"

namespace grapnel {
namespace {

CurvatureParams params_from(const std::vector<std::string>& overrides, const std::string& mode) {
  ConfigTable table("command line", "", 0);
  for (const std::string& assignment : overrides) apply_override(table, assignment);
  if (add_engine(curvature_fields(), mode)) apply_override(table, "engine=" + mode);
  ConfigReader reader(table);
  CurvatureParams params;
  reader.take_fields(curvature_fields(), &params);
  reader.finish();
  return params;
}

void write_csv(const std::string& file, const StoredSurface& stored,
               const PrincipalCurvature& curvature) {
  std::ofstream stream(file, std::ios::binary);
  for (std::size_t i = 0; i < stored.surface.size; ++i) {
    char text[160];
    const auto value = [](float number) { return static_cast<double>(number); };
    std::snprintf(text, sizeof text, "%u,%.9g,%.9g,%.9g,%.9g,%.9g\n", stored.input_of[i],
                  value(curvature.largest()[i]), value(curvature.smallest()[i]),
                  value(curvature.direction(0)[i]), value(curvature.direction(1)[i]),
                  value(curvature.direction(2)[i]));
    stream << text;
  }
  stream.flush();
  if (!stream) throw InputError(file + ": can't be written");
}

std::string field_names() {
  std::string names;
  for (const Field& field : curvature_fields()) {
    names += (names.empty() ? "" : "=, ") + std::string(field.name);
  }
  return names + "=";
}

}  // namespace

int run_curvature(std::span<const std::string> args) {
  std::string file;
  std::string camera;
  std::string csv;
  std::string mode = "fast";
  std::vector<std::string> overrides;
  Options options("curvature", "Measures how the normals around every point spread.");
  options.positional("CLOUD", file, "cloud, PNG with --camera, or RECORDING#N");
  options.repeated("--set", overrides, field_names() + "; repeatable");
  options.value("--mode", mode, "fast, or reference: plain loops in double");
  options.value("--camera", camera, "camera.toml of a bare PNG");
  options.required("--csv", csv,
                   "file to write: a row a point with reading, its index, then the larger and the "
                   "smaller principal curvature and the larger one's direction x, y, z");
  if (!options.parse(args)) return 0;

  const CurvatureParams params = params_from(overrides, mode);
  const Input input = load_input(file, {camera, ""});
  const std::unique_ptr<StoredSurface> stored = make_surface(input);
  Surface& surface = stored->surface;
  surface.spacing_m = measured_spacing_m(surface);
  ensure_normals(surface);
  PrincipalCurvature curvature(params);
  const Block memory =
      carve([&](Arena& arena) { curvature.reserve(arena, limits_for(surface.size)); });
  require_ok(curvature.estimate(surface), "curvature");
  write_csv(csv, *stored, curvature);
  std::cout << csv << ": " << surface.size << " points\n";
  return 0;
}

}  // namespace grapnel
