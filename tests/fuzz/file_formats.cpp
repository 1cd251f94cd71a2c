#include "tests/fuzz/file_formats.h"

#include <cmath>
#include <cstddef>
#include <string_view>
#include <vector>

#include "base/assert.h"
#include "base/cloud_file.h"
#include "base/config.h"
#include "base/config_text.h"
#include "base/input_error.h"
#include "drivers/replay/camera_file.h"
#include "drivers/replay/image_file.h"
#include "drivers/replay/recording_index.h"
#include "firmware_app/settings.h"
#include "firmware_app/snapshot.h"

namespace grapnel::test {
namespace {

/// Runs `read` and lets only its InputError pass.
template <class Read>
void refuse_or(Read read) {
  try {
    read();
  } catch (const InputError& error) {
    GRAPNEL_ASSERT(std::string_view(error.what()).find('\n') == std::string_view::npos);
  }
}

std::string_view text_of(std::span<const std::uint8_t> data) noexcept {
  return {reinterpret_cast<const char*>(data.data()), data.size()};
}

void check(const CloudData& cloud) {
  const std::size_t points = cloud.size();
  GRAPNEL_ASSERT(cloud.y.size() == points && cloud.z.size() == points);
  GRAPNEL_ASSERT(static_cast<std::size_t>(cloud.width) * static_cast<std::size_t>(cloud.height) ==
                 points);
  for (const std::size_t size : {cloud.nx.size(), cloud.ny.size(), cloud.nz.size(),
                                 cloud.intensity.size(), cloud.color.size(), cloud.label.size()}) {
    GRAPNEL_ASSERT(size == 0 || size == points);
  }
  for (std::size_t i = 0; i < points; ++i) {
    GRAPNEL_ASSERT(std::isfinite(cloud.x[i]) == std::isfinite(cloud.z[i]));
    GRAPNEL_ASSERT(std::isfinite(cloud.y[i]) == std::isfinite(cloud.z[i]));
  }
}

}  // namespace

void run_cloud_file(std::span<const std::uint8_t> data) {
  const std::span<const std::byte> bytes = std::as_bytes(data);
  refuse_or([&] { check(parse_cloud(bytes, "fuzz")); });
  refuse_or([&] {
    const MeshData mesh = parse_ply_mesh(bytes, "fuzz");
    for (const auto& triangle : mesh.triangles) {
      for (const std::uint32_t corner : triangle) GRAPNEL_ASSERT(corner < mesh.vertices.size());
    }
  });
}

void run_config_file(std::span<const std::uint8_t> data) {
  const std::string_view text = text_of(data);
  refuse_or([&] {
    const ConfigTable root = parse_config(text, "fuzz");
    bool same = false;
    try {
      same = parse_config(config_text(root), "again").entries().size() == root.entries().size();
    } catch (const InputError&) {
      same = false;
    }
    GRAPNEL_ASSERT(same);
  });
  refuse_or([&] { (void)read_settings(parse_config(text, "fuzz"), "fuzz", "/"); });
  refuse_or([&] {
    ConfigTable root;
    apply_override(root, text);
  });
}

void run_camera_file(std::span<const std::uint8_t> data) {
  refuse_or([&] {
    const CameraFile camera = parse_camera_file(parse_config(text_of(data), "fuzz"));
    GRAPNEL_ASSERT(camera.intrinsics().valid());
    const CameraFile again = parse_camera_file(parse_config(camera_file_text(camera), "again"));
    GRAPNEL_ASSERT(again.width == camera.width && again.invalid == camera.invalid);
  });
}

void run_recording_index(std::span<const std::uint8_t> data) {
  refuse_or([&] {
    for (const IndexRow& row : parse_index(text_of(data), "fuzz")) {
      GRAPNEL_ASSERT(row.time_us >= 0 && !row.file.empty() && row.file.front() != '/');
    }
  });
  refuse_or([&] {
    for (const TimedPose& timed : parse_poses(text_of(data), "fuzz")) {
      GRAPNEL_ASSERT(is_rigid(timed.pose.matrix(), 1e-9));
    }
  });
}

void run_image_file(std::span<const std::uint8_t> data) {
  // A size that libpng and libjpeg would have to fill is no finding, only slow.
  constexpr int kSide_px = 64;
  const std::span<const std::byte> bytes = std::as_bytes(data);
  std::vector<std::uint16_t> depth(kSide_px * kSide_px);
  std::vector<Rgb8> color(kSide_px * kSide_px);
  refuse_or([&] { decode_depth_png(bytes, "fuzz", kSide_px, kSide_px, depth); });
  refuse_or([&] { decode_color_image(bytes, "fuzz", kSide_px, kSide_px, color); });
}

void run_snapshot(std::span<const std::uint8_t> data) {
  refuse_or([&] {
    const Snapshot snapshot = parse_snapshot(std::as_bytes(data), "fuzz");
    const DepthFrame& frame = snapshot.evidence.frame;
    GRAPNEL_ASSERT(frame.intrinsics.valid());
    GRAPNEL_ASSERT(snapshot.depth.size() == frame.depth.pixels());
    const std::size_t background = snapshot.background.size();
    GRAPNEL_ASSERT(background == 0 || background == frame.depth.pixels());
    GRAPNEL_ASSERT(snapshot.color.empty() || snapshot.color.size() == frame.depth.pixels());
    const Snapshot again = parse_snapshot(encode_snapshot(snapshot), "again");
    GRAPNEL_ASSERT(again.report == snapshot.report && again.depth == snapshot.depth);
  });
}

}  // namespace grapnel::test
