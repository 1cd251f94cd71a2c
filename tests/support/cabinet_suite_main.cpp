#include <cstdio>
#include <exception>
#include <iostream>
#include <numeric>
#include <string>
#include <vector>

#include "tests/support/cabinet_set.h"

/// Writes the suite of the recorded cabinet: grapnel-cabinet-suite RECORDING OUT [all|recorded].
/// `all` takes the images with poorer recorded poses too; `recorded` makes the model as large as
/// the recording says instead of as refined.
int main(int argc, char** argv) {
  namespace test = grapnel::test;
  const std::string mode = argc == 4 ? argv[3] : "";
  if (argc < 3 || argc > 4 || (argc == 4 && mode != "all" && mode != "recorded")) {
    std::cerr << "usage: grapnel-cabinet-suite RECORDING OUT [all|recorded]\n";
    return 2;
  }
  try {
    std::vector<int> images = test::good_cabinet_images();
    if (mode == "all") {
      images.resize(40);
      std::iota(images.begin(), images.end(), 0);
    }
    const test::CabinetSet set = test::read_cabinet(argv[1], images);
    test::write_cabinet_suite(set, mode == "recorded" ? set.recorded_half_m : set.half_m, argv[2]);
    std::printf("half sizes, mm: recorded %.1f %.1f %.1f, refined %.1f %.1f %.1f\n",
                1e3 * set.recorded_half_m.x(), 1e3 * set.recorded_half_m.y(),
                1e3 * set.recorded_half_m.z(), 1e3 * set.half_m.x(), 1e3 * set.half_m.y(),
                1e3 * set.half_m.z());
    for (const test::CabinetSet::Image& image : set.images) {
      std::printf("image %2d: moved %4.1f mm, residual %.1f mm\n", image.index, 1e3 * image.moved_m,
                  1e3 * image.residual_m);
    }
  } catch (const std::exception& error) {
    std::cerr << "grapnel-cabinet-suite: " << error.what() << "\n";
    return 2;
  }
  return 0;
}
