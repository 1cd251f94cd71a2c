#include <algorithm>
#include <vector>

#include "base/rng.h"
#include "pipeline/correspond/nearest_feature.h"
#include "pipeline/descriptors/fpfh.h"
#include "pipeline/descriptors/pfh.h"
#include "pipeline/descriptors/spin_image.h"
#include "pipeline/reject/ransac.h"
#include "tests/bench/groups.h"
#include "tests/bench/inputs.h"
#include "tests/bench/peers/open3d.h"
#include "tests/bench/peers/peers.h"
#include "tests/bench/table.h"

namespace grapnel::bench {
namespace {

constexpr int kRuns = 7;
constexpr std::size_t kObject = 7700;
constexpr std::size_t kScene = 26000;
constexpr std::size_t kRows = 1000;
constexpr std::size_t kPairs = 2290;
constexpr std::size_t kDraws = 10000;

/// An estimator with its memory and keypoints spread over a surface.
template <class Estimator>
class Describing {
 public:
  template <class Params>
  Describing(Surface& surface, std::size_t count, Params params)
      : surface_(surface), estimator_(spread(params)), memory_([&](Arena& arena) {
          estimator_.reserve(arena, large());
          features_.reserve(arena, count, estimator_.dimension());
        }) {
    for (std::size_t i = 0; i < count; ++i) {
      keypoints_.push_back({static_cast<std::int32_t>(i * surface.size / count), 1.0F, 0.0F});
    }
  }
  void run() { require(estimator_.describe(surface_, keypoints_, features_).ok(), "descriptors"); }
  [[nodiscard]] const FeatureMatrix& features() const { return features_; }

 private:
  template <class Params>
  static Params spread(Params params) {
    params.radius_ratio = kRadiusRatio;
    return params;
  }
  Surface& surface_;
  Estimator estimator_;
  FeatureMatrix features_;
  std::vector<Keypoint> keypoints_;
  test::ArenaMemory memory_;
};

void print_descriptors() {
  test::OwnedSurface object = make_ball(kObject);
  test::OwnedSurface scene = make_ball(kScene);
  const double near = kRadiusRatio * object->spacing_m;
  PfhParams capped;
  capped.max_neighbours = 99;
  Describing<FpfhEstimator> some(*object, kRows, FpfhParams{});
  Describing<FpfhEstimator> every(*scene, kScene, FpfhParams{});
  Describing<PfhEstimator> pfh(*object, 200, capped);
  Describing<SpinImageEstimator> spin(*object, kRows, SpinImageParams{});
  std::vector<Row> rows;
  rows.push_back({"FPFH, 1000 keypoints on the object of 7.7k, unorganised",
                  8.0,
                  3.0,
                  {},
                  [&] { some.run(); },
                  peers::fpfh(*object, near, kRows)});
  rows.push_back({"FPFH of every point, 26k, unorganised",
                  60.0,
                  20.0,
                  {},
                  [&] { every.run(); },
                  peers::fpfh(*scene, kRadiusRatio * scene->spacing_m, kScene),
                  peers::o3d::fpfh(*scene, kRadiusRatio * scene->spacing_m)});
  rows.push_back({"PFH, 200 keypoints, 99 neighbours",
                  12.0,
                  5.0,
                  {},
                  [&] { pfh.run(); },
                  peers::pfh(*object, near, 200)});
  rows.push_back({"spin images, 1000 keypoints",
                  5.0,
                  2.0,
                  {},
                  [&] { spin.run(); },
                  peers::spin_images(*object, near, kRows)});
  print_rows(rows, kRuns);
}

/// The FPFH of a thousand points of one surface against those of a thousand other ones.
void print_matching() {
  test::OwnedSurface object = make_ball(kObject);
  Describing<FpfhEstimator> described(*object, 2 * kRows, FpfhParams{});
  described.run();
  FeatureMatrix source;
  FeatureMatrix target;
  NearestFeatureParams params;
  params.top = 2;
  NearestFeature matcher(params);
  Limits limits;
  limits.descriptor_dimension = 33;
  const test::ArenaMemory memory([&](Arena& arena) {
    source.reserve(arena, kRows, 33);
    target.reserve(arena, kRows, 33);
    matcher.reserve(arena, limits);
  });
  for (std::size_t i = 0; i < 2 * kRows; ++i) {
    FeatureMatrix& side = i % 2 == 0 ? source : target;
    std::ranges::copy(described.features().row(i), side.row(side.rows++).begin());
  }
  std::vector<Correspondence> storage(2 * kRows);
  Correspondences pairs{storage};
  const auto stride = static_cast<std::size_t>(source.row(1).data() - source.row(0).data());
  std::vector<Row> rows;
  rows.push_back({"match 1000 × 1000 × 33, exact best two; PCL: its tree built before",
                  2.5,
                  0.7,
                  {},
                  [&] { require(matcher.match(source, target, pairs).ok(), "match"); },
                  peers::match_33(source.row(0).data(), target.row(0).data(), kRows, stride)});
  print_rows(rows, kRuns);
}

/// Pairs between a cloud and itself moved; one in `right_in` is right.
void print_ransac(std::size_t right_in, const char* what) {
  test::OwnedSurface source = make_ball(kPairs);
  test::OwnedSurface target = make_ball(kPairs);
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector(Vec3d(0.3, -0.8, 0.4));
  pose.translation() = Vec3d(0.1, 0.2, 0.3);
  test::move(*target, pose);
  std::vector<Keypoint> keypoints;
  std::vector<Correspondence> given;
  std::vector<int> pair_of;
  Rng shuffle(3);
  for (std::size_t i = 0; i < kPairs; ++i) {
    const auto index = static_cast<std::int32_t>(i);
    const auto other = static_cast<std::int32_t>(shuffle.below(static_cast<std::uint32_t>(kPairs)));
    pair_of.push_back(i % right_in == 0 ? index : other);
    keypoints.push_back({index, 1.0F, 0.0F});
    given.push_back({index, pair_of.back(), 1.0F});
  }
  RansacRejectorParams params;
  params.draws = kDraws;
  RansacRejector rejector(params);
  const test::ArenaMemory memory([&](Arena& arena) { rejector.reserve(arena, Limits{}); });
  std::vector<Correspondence> storage(kPairs);
  std::vector<Row> rows;
  rows.push_back(
      {what,
       15.0,
       3.0,
       {},
       [&] {
         Correspondences pairs{storage};
         for (const Correspondence& pair : given) pairs.push_back(pair);
         Rng rng(1);
         require(rejector.reject({&*source, &*target, keypoints, keypoints}, pairs, rng).ok(),
                 "ransac");
       },
       peers::ransac(*source, *target, pair_of.data(), 1.5 * target->spacing_m,
                     static_cast<int>(kDraws))});
  print_rows(rows, kRuns);
}

}  // namespace

void print_features() {
  print_descriptors();
  print_matching();
  print_ransac(2, "RANSAC, 10,000 draws, 2290 pairs, a half right (PCL stops at 99 % confidence)");
  print_ransac(10, "RANSAC, 10,000 draws, 2290 pairs, a tenth right");
}

}  // namespace grapnel::bench
