#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/replay/image_file.h"
#include "pipeline/registrar.h"
#include "tests/bench/groups.h"
#include "tests/bench/peers/open3d.h"
#include "tests/bench/peers/peers.h"
#include "tests/bench/table.h"
#include "tests/support/recorded_data.h"
#include "workbench/surfaces.h"

namespace grapnel::bench {
namespace {

namespace fs = std::filesystem;

const fs::path kConfig = fs::path(GRAPNEL_SOURCE_DIR) / "config";

/// One recorded data set of views with poses.
struct Views {
  std::string_view name;
  const char* folder;
  const char* depth_pattern;
  const char* pose_pattern;
  Intrinsics intrinsics;
};

constexpr double kPerDegree = 3.14159265358979 / 180.0;

constexpr Views kBunny = {"bunny",
                          "primesense_bunny",
                          "depth_%d.png",
                          "poses_%d.txt",
                          {640, 480, 542.0, 540.5, 320.0, 240.0}};
constexpr Views kKitchen = {"kitchen",
                            "7scenes_redkitchen",
                            "frame-%06d.depth.png",
                            "frame-%06d.pose.txt",
                            {640, 480, 585.0, 585.0, 320.0, 240.0}};

std::unique_ptr<Registrar> registrar_of_pairs() {
  return Registrar::create(
      load_preset(find_preset(kConfig / "presets", "pair"), kConfig / "models", {}));
}

/// Voxels of the peers' chains: those tried that they get most right with, then the fastest.
struct PeerVoxels {
  double open3d_m;
  double pcl_m;
};
constexpr PeerVoxels kOfBunny = {0.006, 0.005};
constexpr PeerVoxels kOfKitchen = {0.05, 0.05};

std::string numbered(const char* pattern, int number) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), pattern, number);
  return text.data();
}

std::unique_ptr<StoredSurface> view_of(const Views& views, int number) {
  DepthImage image =
      read_depth_png(test::recorded_data(views.folder) / numbered(views.depth_pattern, number));
  // The kitchen's files mark what was not read by 0 or by this.
  std::replace(image.pixels.begin(), image.pixels.end(), std::uint16_t{65535}, std::uint16_t{0});
  DepthFrame frame;
  frame.depth = image.view();
  frame.intrinsics = views.intrinsics;
  return make_surface(frame);
}

Mat4d world_from_camera(const Views& views, int number) {
  std::ifstream stream(test::recorded_data(views.folder) / numbered(views.pose_pattern, number));
  Mat4d matrix = Mat4d::Identity();
  for (int i = 0; i < 16; ++i) stream >> matrix(i / 4, i % 4);
  return matrix;
}

/// Pairs of views of one data set.
struct Pairs {
  const char* what;
  const Views& views;
  int step;  ///< between the sources
  int apart;
  int count;
  double tolerance_m;
  double must_ms;
  double goal_ms;
  /// PCL's prerejective search too; of whole rooms it is left out for its time.
  bool prerejective;
};

using Chain = std::function<std::optional<Pose>(const Surface& source, const Surface& target)>;

/// Where a chain's pose lies from the given one, at the middle of the source.
struct Off {
  double shift_m = 0.0;
  double turn_rad = 0.0;
};

Off off_truth(const Pairs& pairs, int from, const Surface& source, const Pose& found) {
  const Vec3d middle = centroid(source);
  const Pose truth(Mat4d(world_from_camera(pairs.views, from + pairs.apart).inverse() *
                         world_from_camera(pairs.views, from)));
  return {(found * middle - truth * middle).norm(), rotation_angle_rad(found, truth)};
}

double median_of(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0.0 : values[values.size() / 2];
}

/// One row: every pair by one chain. `ours` alone must keep to times.
void print_row(const Pairs& pairs, const char* who, const Chain& chain, bool ours) {
  std::vector<double> ms;
  std::vector<double> turn_deg;
  std::vector<double> shift_mm;
  int right = 0;
  for (int i = 0; i < pairs.count; ++i) {
    const int from = i * pairs.step;
    const auto source = view_of(pairs.views, from);
    const auto target = view_of(pairs.views, from + pairs.apart);
    const double before = program_ms();
    const std::optional<Pose> found = chain(source->surface, target->surface);
    ms.push_back(program_ms() - before);
    if (!found) continue;
    const Off off = off_truth(pairs, from, source->surface, *found);
    turn_deg.push_back(off.turn_rad / kPerDegree);
    shift_mm.push_back(1e3 * off.shift_m);
    right += off.shift_m < pairs.tolerance_m && off.turn_rad < 5.0 * kPerDegree ? 1 : 0;
  }
  const double p50_ms = median_of(ms);
  std::printf("| %s | %s | %d of %d | %.2f | %.1f | %.1f | %.1f |", pairs.what, who, right,
              pairs.count, median_of(turn_deg), median_of(shift_mm), p50_ms, ms.back());
  if (ours && pairs.must_ms > 0.0) {
    std::printf(" %g | %g |\n", pairs.must_ms, pairs.goal_ms);
  } else {
    std::printf(" | |\n");
  }
  std::fflush(stdout);
}

bool installed(const char* name) { return std::string(name) != "none"; }

void print_by_everyone(Registrar& registrar, const Pairs& pairs, const PeerVoxels& voxels) {
  const Chain ours = [&](const Surface& source, const Surface& target) -> std::optional<Pose> {
    const auto answer = registrar.register_pair(source, target, {});
    if (!answer.ok() || answer.value().objects.empty()) return std::nullopt;
    return answer.value().objects[0].target_from_source;
  };
  print_row(pairs, "Grapnel, preset `pair`", ours, true);
  if (installed(peers::o3d::name())) {
    print_row(
        pairs, "Open3D: FPFH, RANSAC, ICP",
        [&](const Surface& source, const Surface& target) {
          return peers::o3d::register_pair(source, target, voxels.open3d_m);
        },
        false);
  }
  if (!installed(peers::name())) return;
  const auto by_pcl = [&](const char* who, peers::FirstPose first) {
    print_row(
        pairs, who,
        [&](const Surface& source, const Surface& target) {
          return peers::register_pair(source, target, voxels.pcl_m, first);
        },
        false);
  };
  by_pcl("PCL: FPFH, rejector by samples, ICP", peers::FirstPose::Rejector);
  if (pairs.prerejective) {
    by_pcl("PCL: FPFH, prerejective, ICP", peers::FirstPose::Prerejective);
  }
}

bool recorded(const Views& views) { return !test::recorded_data(views.folder).empty(); }

}  // namespace

bool run_one_pair(const std::string& name, int source, int target) {
  for (const Views* const views : {&kBunny, &kKitchen}) {
    if (views->name != name || !recorded(*views)) continue;
    const auto from = view_of(*views, source);
    const auto to = view_of(*views, target);
    (void)registrar_of_pairs()->register_pair(from->surface, to->surface, {});
    return true;
  }
  return false;
}

void print_pairs() {
  const bool bunny = recorded(kBunny);
  const bool kitchen = recorded(kKitchen);
  if (!bunny && !kitchen) {
    std::printf("%s: no recorded pairs.\n\n", test::kNoRecordedData);
    return;
  }
  const auto registrar = registrar_of_pairs();
  std::printf(
      "Recorded pairs of views without initial guess, from points to pose (the peers do without a "
      "verdict); right: within 5° and 2 cm (kitchen 5 cm) before the verdict; medians of the "
      "errors "
      "at the view's middle. Peers: voxels of %g mm (PCL %g mm, kitchen %g mm), normals within 2, "
      "FPFH within 5 of them.\n\n"
      "| pairs | by | right | turn, ° | shift, mm | p50, ms | most, ms | must | goal |\n"
      "|---|---|---|---|---|---|---|---|---|\n",
      1e3 * kOfBunny.open3d_m, 1e3 * kOfBunny.pcl_m, 1e3 * kOfKitchen.open3d_m);
  if (bunny) {
    print_by_everyone(*registrar,
                      {"bunny, 4 frames apart (must 14)", kBunny, 1, 4, 14, 0.02, 15.0, 8.0, true},
                      kOfBunny);
    print_by_everyone(*registrar,
                      {"bunny, 8 frames apart (goal 5)", kBunny, 1, 8, 10, 0.02, 0.0, 0.0, true},
                      kOfBunny);
  }
  if (kitchen) {
    print_by_everyone(
        *registrar,
        {"kitchen, 20 frames apart (must 19)", kKitchen, 9, 20, 20, 0.05, 60.0, 25.0, false},
        kOfKitchen);
  }
  std::printf("\n");
}

}  // namespace grapnel::bench
