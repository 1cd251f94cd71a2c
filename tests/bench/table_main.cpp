// Prints what every stage takes beside what it must take, and beside PCL and Open3D on the same
// input where they are installed: grapnel_bench [filters] [keypoints] [features] [registration]
// [frames] [pairs] [growth]. grapnel_bench frame PRESET runs one frame and prints nothing,
// grapnel_bench pair NAME SOURCE TARGET the same for two recorded views; see instructions.sh.
// GRAPNEL_TARGET names another SIMD target.
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "pipeline/kernels/target.h"
#include "tests/bench/groups.h"
#include "tests/bench/table.h"

namespace grapnel::bench {
namespace {

struct Group {
  std::string_view name;
  void (*print)();
};

constexpr std::array<Group, 7> kGroups = {{{"filters", print_filters},
                                           {"keypoints", print_keypoints},
                                           {"features", print_features},
                                           {"registration", print_registration},
                                           {"frames", print_frames},
                                           {"pairs", print_pairs},
                                           {"growth", print_growth}}};

int run(int argc, char** argv) {
  const char* const target = std::getenv("GRAPNEL_TARGET");
  if (target != nullptr && !kernels::force_target(target)) {
    std::fprintf(stderr, "GRAPNEL_TARGET: %s is not available here\n", target);
    return 2;
  }
  if (argc == 3 && std::string_view(argv[1]) == "frame") return run_one_frame(argv[2]) ? 0 : 2;
  if (argc == 5 && std::string_view(argv[1]) == "pair") {
    return run_one_pair(argv[2], std::atoi(argv[3]), std::atoi(argv[4])) ? 0 : 2;
  }
  for (int i = 1; i < argc; ++i) {
    const auto known = [&](const Group& group) { return group.name == argv[i]; };
    if (std::any_of(kGroups.begin(), kGroups.end(), known)) continue;
    std::fprintf(stderr, "%s: one of", argv[i]);
    for (const Group& group : kGroups) std::fprintf(stderr, " %s", group.name.data());
    std::fprintf(stderr, " is allowed\n");
    return 2;
  }
  print_machine();
  for (const Group& group : kGroups) {
    const auto asked = [&](const char* name) { return group.name == name; };
    if (argc == 1 || std::any_of(argv + 1, argv + argc, asked)) group.print();
  }
  return 0;
}

}  // namespace
}  // namespace grapnel::bench

int main(int argc, char** argv) { return grapnel::bench::run(argc, argv); }
