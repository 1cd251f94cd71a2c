#include <array>
#include <nlohmann/json.hpp>
#include <string_view>

#include "base/file.h"
#include "base/input_error.h"
#include "workbench/import/known_cameras.h"
#include "workbench/import/source.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

/// A public set's way of naming the files of frame N: prefix, N as the depth image has it, suffix.
struct NumberedLayout {
  const char* name;
  const char* folder;  ///< of the depth images, below the source
  const char* prefix;
  const char* suffix;
  std::array<std::pair<const char*, const char*>, 3> colors;  ///< {prefix with folder, suffix}
  std::pair<const char*, const char*> pose;                   ///< 4×4 camera pose; {} none
  const char* intrinsics;                                     ///< 3×3; "" none
};

constexpr std::array kLayouts = {
    NumberedLayout{"7-Scenes",
                   "",
                   "frame-",
                   ".depth.png",
                   {{{"frame-", ".color.png"}, {"frame-", ".color.jpg"}, {"", ""}}},
                   {"frame-", ".pose.txt"},
                   "camera-intrinsics.txt"},
    NumberedLayout{"numbered views",
                   "",
                   "depth_",
                   ".png",
                   {{{"color_", ".png"}, {"color_", ".jpg"}, {"rgb_", ".png"}}},
                   {"poses_", ".txt"},
                   "Intrinsic.txt"},
    NumberedLayout{"depth and rgb folders",
                   "depth",
                   "",
                   ".png",
                   {{{"rgb/", ".png"}, {"rgb/", ".jpg"}, {"color/", ".png"}}},
                   {"pose/", ".txt"},
                   "intrinsics.txt"},
};

void take_matrix(const fs::path& file, Source& source) {
  const std::vector<double> k = read_matrix(file, 3);
  CameraFile camera;
  camera.fx = k[0];
  camera.fy = k[4];
  camera.cx = k[2];
  camera.cy = k[5];
  source.camera = camera;
  source.camera_origin = file.filename().string();
}

void take_known(const fs::path& folder, Source& source) {
  const std::optional<KnownCamera> known = known_camera(fs::absolute(folder).string());
  if (!known) return;
  source.camera = known->camera;
  source.camera_origin = known->origin;
}

Source list_layout(const fs::path& folder, const NumberedLayout& layout,
                   const std::vector<NumberedFile>& depth, const SourceOptions& options) {
  Source source;
  source.layout = layout.name;
  const std::size_t affixes =
      std::string_view(layout.prefix).size() + std::string_view(layout.suffix).size();
  for (const NumberedFile& file : depth) {
    const std::string name = file.file.filename().string();
    const std::string digits =
        name.substr(std::string_view(layout.prefix).size(), name.size() - affixes);
    const auto time_us = static_cast<std::int64_t>(file.number) * options.interval_us;
    SourceFrame frame{time_us, file.file, {}};
    for (const auto& [prefix, suffix] : layout.colors) {
      const fs::path color = folder / (prefix + digits + suffix);
      if (*suffix != '\0' && frame.color.empty() && fs::exists(color)) frame.color = color;
    }
    source.frames.push_back(std::move(frame));
    const fs::path pose_file = folder / (layout.pose.first + digits + layout.pose.second);
    if (!fs::exists(pose_file)) continue;
    const std::optional<Pose> pose = read_pose_matrix(pose_file);
    if (pose) source.poses.push_back({time_us, *pose});
  }
  if (fs::exists(folder / layout.intrinsics)) {
    take_matrix(folder / layout.intrinsics, source);
  } else {
    take_known(folder, source);
  }
  return source;
}

/// raw_depth.png, color_image.png and intrinsics.json: one frame.
std::optional<Source> find_single(const fs::path& folder) {
  if (!fs::exists(folder / "raw_depth.png")) return std::nullopt;
  Source source;
  source.layout = "one frame";
  SourceFrame frame{0, folder / "raw_depth.png", {}};
  if (fs::exists(folder / "color_image.png")) frame.color = folder / "color_image.png";
  source.frames.push_back(std::move(frame));
  const fs::path file = folder / "intrinsics.json";
  if (!fs::exists(file)) return source;
  try {
    const std::vector<std::byte> bytes = read_file(file, kMaxConfigBytes);
    const auto* const text = reinterpret_cast<const char*>(bytes.data());
    const nlohmann::json json = nlohmann::json::parse(text, text + bytes.size());
    CameraFile camera;
    camera.fx = json.at("fx").get<double>();
    camera.fy = json.at("fy").get<double>();
    camera.cx = json.at("cx").get<double>();
    camera.cy = json.at("cy").get<double>();
    source.camera = camera;
    source.camera_origin = "intrinsics.json";
  } catch (const nlohmann::json::exception& error) {
    throw InputError(file.string() + ": " + error.what());
  }
  return source;
}

}  // namespace

std::optional<Source> find_numbered(const fs::path& folder, const SourceOptions& options) {
  if (!fs::is_directory(folder)) return std::nullopt;
  for (const NumberedLayout& layout : kLayouts) {
    const std::vector<NumberedFile> depth =
        numbered_files(folder / layout.folder, layout.prefix, layout.suffix);
    if (!depth.empty()) return list_layout(folder, layout, depth, options);
  }
  return find_single(folder);
}

}  // namespace grapnel
