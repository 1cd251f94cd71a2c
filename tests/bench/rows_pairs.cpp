#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/replay/image_file.h"
#include "pipeline/registrar.h"
#include "tests/bench/groups.h"
#include "tests/bench/table.h"
#include "tests/support/recorded_data.h"
#include "workbench/surfaces.h"

namespace grapnel::bench {
namespace {

namespace fs = std::filesystem;

constexpr double kPerDegree = 3.14159265358979 / 180.0;

std::unique_ptr<Registrar> registrar_of_pairs() {
  const fs::path config = fs::path(GRAPNEL_SOURCE_DIR) / "config";
  return Registrar::create(load_preset(find_preset(config / "presets", "pair"), config / "models"));
}

/// One recorded data set of views with poses.
struct Views {
  std::string_view name;
  const char* folder;
  const char* depth_pattern;
  const char* pose_pattern;
  Intrinsics intrinsics;
  double tolerance_m;
};

constexpr std::array<Views, 2> kViews = {{{"bunny",
                                           "primesense_bunny",
                                           "depth_%d.png",
                                           "poses_%d.txt",
                                           {640, 480, 542.0, 540.5, 320.0, 240.0},
                                           0.02},
                                          {"kitchen",
                                           "7scenes_redkitchen",
                                           "frame-%06d.depth.png",
                                           "frame-%06d.pose.txt",
                                           {640, 480, 585.0, 585.0, 320.0, 240.0},
                                           0.05}}};

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

struct PairRow {
  const char* what;
  const Views& views;
  int step;  ///< between the sources
  int apart;
  int pairs;
  double must_ms;
  double goal_ms;
};

double median_of(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0.0 : values[values.size() / 2];
}

void print_pairs(Registrar& registrar, const PairRow& row) {
  std::vector<double> ms, turn_deg, shift_mm;
  int right = 0;
  for (int i = 0; i < row.pairs; ++i) {
    const int from = i * row.step;
    const auto source = view_of(row.views, from);
    const auto target = view_of(row.views, from + row.apart);
    Vec3d middle = Vec3d::Zero();
    for (std::size_t p = 0; p < source->surface.size; ++p) {
      middle += source->surface.point(p).cast<double>();
    }
    middle /= static_cast<double>(source->surface.size);
    const double before = thread_ms();
    const auto answer = registrar.register_pair(source->surface, target->surface, {});
    ms.push_back(thread_ms() - before);
    if (!answer.ok() || answer.value().objects.empty()) continue;
    const Pose truth(Mat4d(world_from_camera(row.views, from + row.apart).inverse() *
                           world_from_camera(row.views, from)));
    const Pose& found = answer.value().objects[0].target_from_source;
    const double shift_m = (found * middle - truth * middle).norm();
    const double turn_rad = rotation_angle_rad(found, truth);
    turn_deg.push_back(turn_rad / kPerDegree);
    shift_mm.push_back(1e3 * shift_m);
    right += shift_m < row.views.tolerance_m && turn_rad < 5.0 * kPerDegree ? 1 : 0;
  }
  const double p50_ms = median_of(ms);
  std::printf("| %s | %d of %d | %.2f | %.1f | %.1f | %.1f |", row.what, right, row.pairs,
              median_of(turn_deg), median_of(shift_mm), p50_ms, ms.back());
  if (row.must_ms > 0.0) {
    std::printf(" %g | %g |\n", row.must_ms, row.goal_ms);
  } else {
    std::printf(" | |\n");
  }
  std::fflush(stdout);
}

bool recorded(const Views& views) { return !test::recorded_data(views.folder).empty(); }

}  // namespace

bool run_one_pair(const std::string& name, int source, int target) {
  for (const Views& views : kViews) {
    if (views.name != name || !recorded(views)) continue;
    const auto from = view_of(views, source);
    const auto to = view_of(views, target);
    (void)registrar_of_pairs()->register_pair(from->surface, to->surface, {});
    return true;
  }
  return false;
}

void print_pairs() {
  const Views& bunny = kViews[0];
  const Views& kitchen = kViews[1];
  if (!recorded(bunny) && !recorded(kitchen)) {
    std::printf("%s: no recorded pairs.\n\n", test::kNoRecordedData);
    return;
  }
  const auto registrar = registrar_of_pairs();
  std::printf(
      "Recorded pairs of views, preset `pair`, no initial guess; right: within 5° and 2 cm "
      "(kitchen 5 cm) before the verdict; medians of the errors at the middle of the view.\n\n"
      "| pairs | right | turn, ° | shift, mm | p50, ms | most, ms | must | goal |\n"
      "|---|---|---|---|---|---|---|---|\n");
  if (recorded(bunny)) {
    print_pairs(*registrar, {"bunny, 4 frames apart (must 14; Open3D 14 in 169 ms)", bunny, 1, 4,
                             14, 15.0, 8.0});
    print_pairs(*registrar,
                {"bunny, 8 frames apart (goal 5; best peer 1)", bunny, 1, 8, 10, 0.0, 0.0});
  }
  if (recorded(kitchen)) {
    print_pairs(*registrar, {"kitchen, 20 frames apart (must 19; Open3D 19 in 2072 ms)", kitchen, 9,
                             20, 20, 60.0, 25.0});
  }
  std::printf("\n");
}

}  // namespace grapnel::bench
