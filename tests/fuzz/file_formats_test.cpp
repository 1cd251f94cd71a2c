// The fuzzers' entries on whole files of each format with random damage.
#include "tests/fuzz/file_formats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "base/cloud_file.h"
#include "base/file.h"
#include "base/rng.h"
#include "drivers/replay/camera_file.h"
#include "drivers/replay/image_file.h"
#include "firmware_app/snapshot.h"
#include "tests/support/temp_folder.h"

namespace grapnel::test {
namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr int kRounds = 3000;

Bytes bytes_of(std::string_view text) { return {text.begin(), text.end()}; }

Bytes bytes_of_file(const std::filesystem::path& file) {
  Bytes bytes;
  for (const std::byte byte : read_file(file, 1 << 20)) {
    bytes.push_back(std::to_integer<std::uint8_t>(byte));
  }
  return bytes;
}

/// Cuts, repeats, flips and overwrites at up to six places.
Bytes damaged(const Bytes& whole, Rng& rng) {
  Bytes bytes = whole;
  const auto below = [&](std::size_t bound) {
    return static_cast<std::size_t>(rng.below(static_cast<std::uint32_t>(bound)));
  };
  for (std::uint32_t i = 1 + rng.below(6); i > 0 && !bytes.empty(); --i) {
    const std::size_t at = below(bytes.size());
    const auto place = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    switch (rng.below(6)) {
      case 0:
        bytes[at] = static_cast<std::uint8_t>(rng.below(256));
        break;
      case 1:
        bytes[at] = static_cast<std::uint8_t>(bytes[at] ^ (1u << rng.below(8)));
        break;
      case 2:
        bytes.resize(at);
        break;
      case 3:
        bytes.insert(place, 1 + below(20), static_cast<std::uint8_t>('0' + rng.below(10)));
        break;
      case 4:
        bytes.erase(place, place + static_cast<std::ptrdiff_t>(
                                       1 + below(std::min<std::size_t>(bytes.size() - at, 40))));
        break;
      default: {
        const std::size_t count = std::min<std::size_t>(bytes.size() - at, 1 + below(60));
        const Bytes piece(place, place + static_cast<std::ptrdiff_t>(count));
        bytes.insert(place, piece.begin(), piece.end());
        break;
      }
    }
  }
  return bytes;
}

void damage_and_run(const std::vector<Bytes>& seeds, void (*run)(std::span<const std::uint8_t>)) {
  Rng rng(2024);
  for (const Bytes& seed : seeds) {
    run(seed);
    for (int round = 0; round < kRounds; ++round) run(damaged(seed, rng));
  }
}

CloudData small_cloud() {
  CloudData cloud;
  for (int i = 0; i < 6; ++i) {
    cloud.x.push_back(static_cast<float>(i));
    cloud.y.push_back(0.5f);
    cloud.z.push_back(1.0f);
    cloud.intensity.push_back(0.25f);
    cloud.color.push_back({1, 2, 3});
    cloud.label.push_back(7);
  }
  cloud.width = 3;
  cloud.height = 2;
  return cloud;
}

TEST(DamagedFiles, CloudsAndMeshesAreReadOrRefused) {
  const TempFolder folder;
  std::vector<Bytes> seeds;
  for (const PcdEncoding encoding :
       {PcdEncoding::Ascii, PcdEncoding::Binary, PcdEncoding::BinaryCompressed}) {
    write_pcd(folder / "c", small_cloud(), encoding);
    seeds.push_back(bytes_of_file(folder / "c"));
  }
  MeshData mesh;
  mesh.vertices = {{0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}};
  mesh.triangles = {{0, 1, 2}};
  for (const PlyEncoding encoding : {PlyEncoding::Ascii, PlyEncoding::BinaryLittleEndian}) {
    write_ply(folder / "c", small_cloud(), encoding);
    seeds.push_back(bytes_of_file(folder / "c"));
    write_ply(folder / "c", mesh, encoding);
    seeds.push_back(bytes_of_file(folder / "c"));
  }
  damage_and_run(seeds, &run_cloud_file);
}

TEST(DamagedFiles, SnapshotsAreReadOrRefused) {
  std::vector<std::uint16_t> depth(12 * 8, 900);
  std::vector<Rgb8> color(12 * 8, Rgb8{1, 2, 3});
  Snapshot snapshot;
  JobEvidence& job = snapshot.evidence;
  job.frame.depth = {depth.data(), 12, 8};
  job.frame.color = {color.data(), 12, 8};
  job.frame.intrinsics = {12, 8, 10.0, 10.0, 5.5, 3.5};
  job.frame.metres_per_unit = 0.001;
  job.context.has_last_pick = true;
  job.context.background.depth = job.frame.depth;
  job.context.background.has_plane = true;
  job.context.background.plane_normal = {0.0, 0.0, -1.0};
  snapshot.preset = {
      "active_preset = 10\n", "10-x.toml", "[preset]\n", {"a=1"}, "models", {{"m", 7}}};
  snapshot.report = "code = 1100\n";
  const std::vector<std::byte> bytes = encode_snapshot(snapshot);
  const auto* first = reinterpret_cast<const std::uint8_t*>(bytes.data());
  damage_and_run({Bytes(first, first + bytes.size())}, &run_snapshot);
}

TEST(DamagedFiles, ConfigurationsAreReadOrRefused) {
  const std::filesystem::path shipped = std::filesystem::path(GRAPNEL_SOURCE_DIR) / "config";
  damage_and_run({bytes_of_file(shipped / "grapnel.toml"),
                  bytes_of("a = {b = [1, 2.5, \"x\\n\"], c.d = true}\n[[e]]\nf = -1e9\n")},
                 &run_config_file);
}

TEST(DamagedFiles, CameraFilesAreReadOrRefused) {
  CameraFile camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 525.0;
  camera.distortion = {0.1, -0.2};
  camera.serial = "A1";
  damage_and_run({bytes_of(camera_file_text(camera))}, &run_camera_file);
}

TEST(DamagedFiles, RecordingIndexesAreReadOrRefused) {
  damage_and_run({bytes_of("# timestamp filename\n1305031229.528784 depth/1305031229.528784.png\n"
                           "1305031229.564442 depth/1305031229.564442.png\n"),
                  bytes_of("# timestamp tx ty tz qx qy qz qw\n1305031225.9334 1.3357 0.6698 1.6180 "
                           "0.6504 0.6012 -0.3056 -0.3496\n")},
                 &run_recording_index);
}

TEST(DamagedFiles, ImagesAreReadOrRefused) {
  const TempFolder folder;
  std::vector<std::uint16_t> depth(64 * 64);
  std::vector<Rgb8> color(64 * 64);
  for (std::size_t i = 0; i < depth.size(); ++i) {
    depth[i] = static_cast<std::uint16_t>(900 + i % 13);
    color[i] = {static_cast<std::uint8_t>(i), 4, 5};
  }
  write_depth_png(folder / "d.png", {depth.data(), 64, 64});
  write_color_png(folder / "c.png", {color.data(), 64, 64});
  damage_and_run({bytes_of_file(folder / "d.png"), bytes_of_file(folder / "c.png")},
                 &run_image_file);
}

}  // namespace
}  // namespace grapnel::test
