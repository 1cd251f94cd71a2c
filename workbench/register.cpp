#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "base/cloud_file.h"
#include "base/input_error.h"
#include "workbench/answer.h"
#include "workbench/commands.h"
#include "workbench/evaluate/statistics.h"
#include "workbench/job.h"
#include "workbench/options.h"
#include "workbench/picture/job_picture.h"
#include "workbench/pose_text.h"

namespace grapnel {
namespace {

struct RegisterOptions {
  JobInputs inputs;
  std::string preset;
  std::vector<std::string> overrides;
  std::string merged;
  std::string picture;
  std::string simd;
  std::int64_t repeat = 1;
  std::int64_t panel_px = 480;
  bool json = false;
};

std::optional<RegisterOptions> parse(std::span<const std::string> args) {
  RegisterOptions wanted;
  std::string camera;
  std::string initial;
  std::string symmetry;
  bool object = false;
  bool pair = false;
  Options options("register", "Moves SOURCE onto TARGET and says whether the pose can be trusted.");
  options.positional("SOURCE", wanted.inputs.source,
                     "model (.ply, .pcd), cloud, PNG or RECORDING#N");
  options.positional("TARGET", wanted.inputs.target, "cloud, PNG or RECORDING#N");
  options.value("--preset", wanted.preset,
                "name, number or file; without it object when SOURCE is a model with NAME.toml or "
                "--object is given, else pair");
  options.repeated("--set", wanted.overrides, "key=value over the preset's; repeatable");
  options.value("--initial", initial, "file with 16 numbers, target_from_source, to start from");
  options.flag("--object", object, "SOURCE is a model that is looked for in TARGET");
  options.flag("--pair", pair, "SOURCE and TARGET are two views");
  options.value("--symmetry", symmetry, "of the model, over its own: none, z180, box, axis_z, …");
  options.value("--camera", camera, "camera.toml of bare PNGs, .oni and fakenect frames");
  options.value("--color", wanted.inputs.target_options.color, "colour of a bare PNG target");
  options.value("--source-color", wanted.inputs.source_options.color, "the same of the source");
  options.value("--simd", wanted.simd, "force this SIMD target");
  options.flag("--json", wanted.json, "one JSON object on stdout");
  options.value("-o,--output", wanted.merged, "write both clouds, source moved, as .ply or .pcd");
  options.value("--picture", wanted.picture,
                "write a .png: depth, the poses on it, what the measurement says of them");
  options.integer("--panel-px", wanted.panel_px, 32, 2000, "longer side of the picture's panels");
  options.integer("--repeat", wanted.repeat, 1, 1000000, "runs in this process; adds percentiles");
  if (!options.parse(args)) return std::nullopt;
  if (object && pair) throw InputError("--object and --pair exclude each other");

  wanted.inputs.source_options.camera = camera;
  wanted.inputs.target_options.camera = camera;
  if (!initial.empty()) wanted.inputs.initial = load_pose(initial);
  if (!symmetry.empty()) wanted.inputs.symmetry = symmetry_from_name(symmetry);
  const bool named_pair = wanted.preset == "pair";
  const bool named_other = !wanted.preset.empty() && !named_pair;
  const bool is_object = object || (!pair && !named_pair &&
                                    (has_model_file(wanted.inputs.source) ||
                                     (named_other && is_cloud_name(wanted.inputs.source))));
  wanted.inputs.kind = is_object ? RegistrationKind::Object : RegistrationKind::Pair;
  if (wanted.preset.empty()) wanted.preset = is_object ? "object" : "pair";
  return wanted;
}

void append_moved(const CloudData& cloud, const Pose& pose, const Rgb8& color, CloudData& merged) {
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vec3d p = pose * Vec3d(cloud.x[i], cloud.y[i], cloud.z[i]);
    if (!p.allFinite()) continue;
    merged.x.push_back(static_cast<float>(p.x()));
    merged.y.push_back(static_cast<float>(p.y()));
    merged.z.push_back(static_cast<float>(p.z()));
    merged.color.push_back(cloud.has_color() ? cloud.color[i] : color);
  }
}

/// The source gets one colour, so that it stands out; the target keeps its own.
void write_merged(const std::string& file, const Job& job, const Pose& target_from_source) {
  constexpr Rgb8 kSourceColor = {230, 120, 30};
  constexpr Rgb8 kTargetColor = {150, 160, 175};
  CloudData source = job.source_cloud();
  source.color.clear();
  CloudData merged;
  append_moved(source, target_from_source, kSourceColor, merged);
  append_moved(job.target_cloud(), Pose::Identity(), kTargetColor, merged);
  merged.width = static_cast<int>(merged.size());
  write_cloud(file, merged);
}

/// Every accepted object, or the best pose when none is, and the one that it can't be told from.
void write_picture(const std::string& file, int panel_px, const Job& job, const Answer& answer) {
  std::vector<Pose> poses;
  for (const RegistrationReport& object : answer.objects) {
    if (object.accepted && object.has_pose) poses.push_back(object.target_from_source);
  }
  DrawnJob drawn{&job.target(), job.model(), job.source()};
  if (poses.empty() && answer.report.has_pose) {
    poses.push_back(answer.report.target_from_source);
    if (answer.report.has_rival) drawn.rival = answer.report.target_from_rival;
  }
  PictureParams params;
  params.panel_px = panel_px;
  params.whole_image = answer.objects.size() > 1;
  write_png(file, draw_job(drawn, poses, std::nullopt, params));
}

void print_text(const RegisterOptions& wanted, const Answer& answer,
                const std::vector<double>& total_ms) {
  const RegistrationReport& report = answer.report;
  std::cout << verdict_text(answer) << "\n";
  if (report.has_pose) {
    std::cout << "target_from_source\n" << pose_text(report.target_from_source);
    if (report.has_rival) {
      std::cout << "or, not told apart\n" << pose_text(report.target_from_rival);
    }
    std::printf(
        "fitness %.3f  rmse %.2f mm  coverage %.3f  free space violation %.3f  margin %.3f\n",
        report.fitness, report.rmse_m * 1e3, report.coverage, report.free_space_violation,
        report.margin);
    std::printf("sigma %.2f mm, %.4f rad\n", report.sigma_m * 1e3, report.sigma_rad);
  }
  std::printf("%s, preset %s, seed %u, %.1f ms\n", Registrar::simd_target(), wanted.preset.c_str(),
              answer.seed, answer.total_ms);
  if (total_ms.size() > 1) {
    std::printf("%zu runs: p50 %.1f ms, p99 %.1f ms, max %.1f ms\n", total_ms.size(),
                quantile(total_ms, 0.5), quantile(total_ms, 0.99), quantile(total_ms, 1.0));
  }
}

void print_json(const RegisterOptions& wanted, const Answer& answer,
                const std::vector<double>& total_ms) {
  nlohmann::ordered_json json = to_json(answer);
  json["simd"] = Registrar::simd_target();
  json["preset"] = wanted.preset;
  if (total_ms.size() > 1) {
    json["total_ms_p50"] = quantile(total_ms, 0.5);
    json["total_ms_p99"] = quantile(total_ms, 0.99);
    json["total_ms_max"] = quantile(total_ms, 1.0);
  }
  std::cout << json.dump(2) << "\n";
}

}  // namespace

int run_register(std::span<const std::string> args) {
  const std::optional<RegisterOptions> wanted = parse(args);
  if (!wanted) return 0;
  if (!wanted->simd.empty() && !Registrar::force_simd_target(wanted->simd)) {
    throw InputError("--simd " + wanted->simd + ": not a target of this machine and build");
  }
  Job job(wanted->inputs, wanted->preset, wanted->overrides);
  std::vector<double> total_ms;
  Answer answer;
  for (std::int64_t i = 0; i < wanted->repeat; ++i) {
    answer = job.run();
    total_ms.push_back(answer.total_ms);
  }
  if (!wanted->merged.empty() && answer.report.has_pose) {
    write_merged(wanted->merged, job, answer.report.target_from_source);
  }
  if (!wanted->picture.empty()) {
    write_picture(wanted->picture, static_cast<int>(wanted->panel_px), job, answer);
  }
  if (wanted->json) {
    print_json(*wanted, answer, total_ms);
  } else {
    std::fflush(stdout);
    print_text(*wanted, answer, total_ms);
    std::fflush(stdout);
  }
  return answer.status == Answer::Status::Accepted ? 0 : 1;
}

}  // namespace grapnel
