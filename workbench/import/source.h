#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "drivers/replay/camera_file.h"
#include "drivers/replay/recording_index.h"

namespace grapnel {

/// One exposure of a foreign recording: files as they are there.
struct SourceFrame {
  std::int64_t time_us = 0;
  std::filesystem::path depth;  ///< .png, .tif(f), organised .pcd, fakenect's .pgm
  std::filesystem::path color;  ///< empty: none; for a .pcd its own colours
};

/// A foreign recording, found and listed, not yet decoded.
struct Source {
  std::string layout;                ///< for people: "TUM RGB-D", "7-Scenes", …
  std::optional<CameraFile> camera;  ///< width and height 0: those of the first image
  std::string camera_origin;         ///< where its numbers come from
  bool fixed_unit = false;           ///< the counts are `camera`'s, whatever another file says
  std::vector<SourceFrame> frames;   ///< ascending in time
  std::vector<SourceFrame> colors;   ///< images with a time of their own (`color` only)
  bool unregistered_color = false;   ///< colours are not those of the depth's pixels
  std::vector<TimedPose> poses;
  std::size_t left_out = 0;                       ///< listed, but not there or not usable
  std::vector<std::filesystem::path> side_files;  ///< copied as they are
};

struct SourceOptions {
  std::int64_t interval_us = 33'333;  ///< where the source has no times
  bool skip_damaged = false;          ///< leave damaged images out instead of refusing the source
};

/// Each finder answers nothing when the folder has another layout, and throws InputError when it
/// has this one but can't be read.
[[nodiscard]] std::optional<Source> find_tum(const std::filesystem::path& folder,
                                             const SourceOptions& options);
/// 7-Scenes, numbered depth_N.png, paired depth/ and rgb/ folders, a single raw_depth.png.
[[nodiscard]] std::optional<Source> find_numbered(const std::filesystem::path& folder,
                                                  const SourceOptions& options);
/// A folder of libfreenect's fakenect-record: INDEX.txt, d-….pgm, r-….ppm. Every file it names is
/// looked at; a damaged one is refused with its line, or left out with SourceOptions::skip_damaged.
[[nodiscard]] std::optional<Source> find_fakenect(const std::filesystem::path& folder,
                                                  const SourceOptions& options);
/// TIFF pairs as PCL's grabber writes them.
[[nodiscard]] std::optional<Source> find_tiff(const std::filesystem::path& folder,
                                              const SourceOptions& options);
/// Organised PCD files, or one.
[[nodiscard]] std::optional<Source> find_clouds(const std::filesystem::path& path,
                                                const SourceOptions& options);

/// The first layout that fits. Throws InputError when none does.
[[nodiscard]] Source find_source(const std::filesystem::path& path, const SourceOptions& options);

/// Files of `folder` whose name is PREFIX digits SUFFIX, by their number.
struct NumberedFile {
  std::uint64_t number = 0;
  std::filesystem::path file;
};
[[nodiscard]] std::vector<NumberedFile> numbered_files(const std::filesystem::path& folder,
                                                       const std::string& prefix,
                                                       const std::string& suffix);

/// "…20121214T142255.814212…" as microseconds since 1970 (UTC). Nothing when there is no such text.
[[nodiscard]] std::optional<std::int64_t> time_in_name(const std::string& name);

/// A 3×3 (`size` 3) or 4×4 matrix as rows of numbers. Throws InputError.
[[nodiscard]] std::vector<double> read_matrix(const std::filesystem::path& file, std::size_t size);

/// A 4×4 rigid matrix; nothing where a tracker wrote "lost" (not finite, or no rotation).
[[nodiscard]] std::optional<Pose> read_pose_matrix(const std::filesystem::path& file);

}  // namespace grapnel
