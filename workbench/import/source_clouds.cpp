#include <algorithm>
#include <cmath>
#include <string_view>

#include "base/cloud_file.h"
#include "base/input_error.h"
#include "workbench/import/cloud_grid.h"
#include "workbench/import/known_cameras.h"
#include "workbench/import/source.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

constexpr double kSameCamera_px = 0.05;

std::vector<fs::path> files_ending(const fs::path& folder, std::string_view ending) {
  std::vector<fs::path> files;
  std::error_code code;
  for (const auto& entry : fs::directory_iterator(folder, code)) {
    if (entry.path().filename().string().ends_with(ending)) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::int64_t time_of(const fs::path& file, std::size_t index, const SourceOptions& options) {
  const std::optional<std::int64_t> time_us = time_in_name(file.filename().string());
  return time_us ? *time_us : static_cast<std::int64_t>(index) * options.interval_us;
}

bool same_camera(const CameraFile& a, const CameraFile& b) noexcept {
  const auto near = [](double p, double q) { return std::fabs(p - q) <= kSameCamera_px; };
  return a.width == b.width && a.height == b.height && near(a.fx, b.fx) && near(a.fy, b.fy) &&
         near(a.cx, b.cx) && near(a.cy, b.cy);
}

/// Takes the cloud when it is an image of the same camera as the ones before.
void take_cloud(const fs::path& file, const SourceOptions& options, Source& source) {
  const CloudData cloud = read_cloud(file);
  std::optional<CameraFile> camera = estimate_camera(cloud);
  if (!camera || (source.camera && !same_camera(*camera, *source.camera))) {
    ++source.left_out;
    return;
  }
  const double unit_m = fitting_unit_m(cloud);
  if (!source.camera) {
    camera->metres_per_unit = unit_m;
    source.camera = camera;
  }
  source.camera->metres_per_unit = std::min(source.camera->metres_per_unit, unit_m);
  source.frames.push_back({time_of(file, source.frames.size(), options), file, {}});
}

}  // namespace

std::optional<Source> find_tiff(const fs::path& folder, const SourceOptions& options) {
  if (!fs::is_directory(folder)) return std::nullopt;
  Source source;
  source.layout = "TIFF pairs";
  for (const std::string_view ending : {"_depth.tiff", "_depth.tif"}) {
    for (const fs::path& depth : files_ending(folder, ending)) {
      SourceFrame frame{time_of(depth, source.frames.size(), options), depth, {}};
      std::string name = depth.filename().string();
      name.replace(name.size() - ending.size(), 6, "_rgb");
      if (fs::exists(folder / name)) frame.color = folder / name;
      source.frames.push_back(std::move(frame));
    }
  }
  if (source.frames.empty()) return std::nullopt;
  return source;
}

std::optional<Source> find_clouds(const fs::path& path, const SourceOptions& options) {
  std::vector<fs::path> files = {path};
  if (fs::is_directory(path)) files = files_ending(path, ".pcd");
  if (files.empty() || files.front().extension() != ".pcd") return std::nullopt;
  Source source;
  source.layout = "organised PCD";
  source.camera_origin = "the clouds themselves (least squares)";
  for (const fs::path& file : files) take_cloud(file, options, source);
  return source;
}

}  // namespace grapnel
