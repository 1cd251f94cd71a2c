#include "workbench/import/known_cameras.h"

#include <array>
#include <string_view>

namespace grapnel {
namespace {

struct Row {
  std::string_view word;
  double fx, fy, cx, cy;
  double counts_per_metre;
  std::string_view origin;
};

// TUM: Sturm et al. 2012 and the benchmark's page on file formats (colour cameras, to which the
// depth is registered). IC-BIN: the values that its users share.
constexpr std::array<Row, 4> kRows = {{
    {"freiburg1", 517.3, 516.5, 318.6, 255.3, 5000.0, "TUM's calibration of freiburg1"},
    {"freiburg2", 520.9, 521.0, 325.1, 249.7, 5000.0, "TUM's calibration of freiburg2"},
    {"freiburg3", 535.4, 539.2, 320.1, 247.6, 5000.0, "TUM's calibration of freiburg3"},
    {"icbin", 550.0, 540.0, 320.0, 240.0, 1000.0, "the values in use for IC-BIN"},
}};
constexpr double kNominalFocal_px = 525.0;
constexpr double kNominalWidth_px = 640.0;

}  // namespace

std::optional<KnownCamera> known_camera(const std::string& text) {
  for (const Row& row : kRows) {
    if (text.find(row.word) == std::string::npos) continue;
    KnownCamera known;
    known.camera.width = 640;
    known.camera.height = 480;
    known.camera.fx = row.fx;
    known.camera.fy = row.fy;
    known.camera.cx = row.cx;
    known.camera.cy = row.cy;
    known.camera.metres_per_unit = 1.0 / row.counts_per_metre;
    known.origin = row.origin;
    return known;
  }
  return std::nullopt;
}

KnownCamera nominal_camera(int width, int height) {
  KnownCamera nominal;
  nominal.camera.width = width;
  nominal.camera.height = height;
  nominal.camera.fx = nominal.camera.fy = kNominalFocal_px * width / kNominalWidth_px;
  nominal.camera.cx = 0.5 * (width - 1);
  nominal.camera.cy = 0.5 * (height - 1);
  nominal.origin = "a Kinect's nominal values, for want of better: give --camera";
  return nominal;
}

}  // namespace grapnel
