#include <deque>
#include <string>
#include <vector>

#include "pipeline/keypoints/curvature.h"
#include "pipeline/keypoints/harris3d.h"
#include "pipeline/keypoints/iss.h"
#include "pipeline/keypoints/narf.h"
#include "pipeline/keypoints/sift3d.h"
#include "tests/bench/groups.h"
#include "tests/bench/inputs.h"
#include "tests/bench/peers/open3d.h"
#include "tests/bench/peers/peers.h"
#include "tests/bench/table.h"

namespace grapnel::bench {
namespace {

constexpr int kRuns = 7;
/// Views of 7.7k and 26k points.
constexpr int kObjectWidth = 101;
constexpr int kSceneWidth = 186;

/// Rows of detectors over views that live as long as this.
class DetectorRows {
 public:
  void add(const std::string& method, const std::string& what, Surface& surface, double must_ms,
           double goal_ms, peers::Work peer, peers::Work open3d = {}) {
    Held<KeypointDetector>& held =
        held_.emplace_back(make(find_method(keypoint_detectors(), method)));
    KeypointDetector* const detector = held.stage.get();
    rows_.push_back({what, must_ms, goal_ms, [this] { found_.clear(); },
                     [this, detector, &surface] {
                       require(detector->detect(surface, found_).ok(), "keypoints");
                     },
                     std::move(peer), std::move(open3d)});
  }
  void print() const { print_rows(rows_, kRuns); }

 private:
  std::deque<Held<KeypointDetector>> held_;
  std::vector<Keypoint> storage_ = std::vector<Keypoint>(large().max_keypoints);
  KeypointSet found_{std::span<Keypoint>(storage_)};
  std::vector<Row> rows_;
};

}  // namespace

void print_keypoints() {
  test::TestFrame frame = make_frame();
  test::OwnedSurface whole(kPixels, kPixels);
  fill(frame, 1, *whole);
  DetectorRows rows;
  std::deque<test::OwnedSurface> views;
  for (const bool on_grid : {true, false}) {
    const std::string from = on_grid ? " view" : " unorganised";
    Surface& object = *views.emplace_back(make_view(kObjectWidth, on_grid));
    Surface& scene = *views.emplace_back(make_view(kSceneWidth, on_grid));
    const double far = scene.spacing_m;
    const auto iss = [](const Surface& s) {
      return peers::iss(s, 6.0 * s.spacing_m, 4.0 * s.spacing_m);
    };
    const auto open3d_iss = [](const Surface& s) {
      return peers::o3d::iss(s, 6.0 * s.spacing_m, 4.0 * s.spacing_m);
    };
    rows.add("iss", "ISS, object of 7.7k," + from, object, 3.0, 1.0, iss(object),
             open3d_iss(object));
    rows.add("iss", "ISS, scene of 26k," + from, scene, 10.0, 3.0, iss(scene), open3d_iss(scene));
    rows.add("harris3d", "Harris 3D, 26k," + from, scene, 8.0, 2.0,
             peers::harris(scene, HarrisParams{}.radius_ratio * far));
    const SiftParams sift;
    rows.add("sift3d", "SIFT 3D, 26k," + from, scene, 40.0, 8.0,
             peers::sift(scene, sift.min_scale_ratio * far, sift.octaves, sift.scales_per_octave,
                         sift.min_contrast));
    rows.add("principal_curvature",
             "principal-curvature keypoints, 26k," + from + "; PCL: curvatures alone", scene, 5.0,
             1.5, peers::curvatures(scene, CurvatureParams{}.radius_ratio * far));
    if (!on_grid) continue;
    rows.add("narf", "NARF, full frame", *whole, 30.0, 5.0,
             peers::narf(*whole, NarfParams{}.support_ratio * whole->spacing_m));
  }
  rows.print();
}

}  // namespace grapnel::bench
