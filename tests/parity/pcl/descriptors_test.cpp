// Descriptors against PCL's on the same clouds, at PCL's parameters.
#include <gtest/gtest.h>
#include <pcl/features/fpfh.h>
#include <pcl/features/pfh.h>
#include <pcl/features/spin_image.h>
#include <pcl/search/kdtree.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/descriptors/fpfh.h"
#include "pipeline/descriptors/pfh.h"
#include "pipeline/descriptors/spin_image.h"
#include "pipeline/preprocess/normals.h"
#include "tests/parity/pcl/clouds.h"
#include "tests/support/recorded_data.h"

namespace grapnel {
namespace {

/// A cloud with our normals, which both sides get, and what to describe of it.
struct Scene {
  test::OwnedSurface surface;
  double radius_m = 0.0;
  std::vector<int> points;

  Scene(test::OwnedSurface given, double normal_m, double radius)
      : surface(std::move(given)), radius_m(radius) {
    PcaNormalsParams params;
    params.radius_m = normal_m;
    PcaNormals normals(params);
    const test::ArenaMemory memory(
        [&](Arena& arena) { normals.reserve(arena, test::limits_for(*surface)); });
    EXPECT_TRUE(normals.estimate(*surface).ok());
    for (std::size_t i = 0; i < surface->size; i += surface->size / 40) {
      points.push_back(static_cast<int>(i));
    }
  }
};

class DescriptorsAgainstPcl : public testing::TestWithParam<Engine> {
 protected:
  /// A generated cloud, and a recorded one where there is one.
  static std::vector<Scene> scenes() {
    std::vector<Scene> list;
    test::OwnedSurface ball = test::bumpy_ball(3000, 0.2);
    const double spacing = ball->spacing_m;
    list.emplace_back(std::move(ball), 4.0 * spacing, 6.0 * spacing);
    if (!test::recorded_data("pcl_test/milk.pcd").empty()) {
      list.emplace_back(test::recorded_surface("pcl_test/milk.pcd"), 0.01, 0.015);
    }
    return list;
  }

  template <class Estimator, class Params>
  std::vector<std::vector<float>> ours(Scene& scene, Params params) {
    params.radius_m = scene.radius_m;
    params.max_neighbours = 2000;
    params.engine = GetParam();
    Estimator estimator(params);
    Limits limits = test::limits_for(*scene.surface);
    FeatureMatrix features;
    const test::ArenaMemory memory([&](Arena& arena) {
      estimator.reserve(arena, limits);
      features.reserve(arena, scene.points.size(), estimator.dimension());
    });
    std::vector<Keypoint> keypoints;
    for (const int point : scene.points) keypoints.push_back({point, 1.0F, 0.0F});
    EXPECT_TRUE(estimator.describe(*scene.surface, keypoints, features).ok());
    std::vector<std::vector<float>> rows;
    for (std::size_t i = 0; i < features.rows; ++i) {
      rows.emplace_back(features.row(i).begin(), features.row(i).end());
    }
    return rows;
  }

  template <class Histogram, class Estimator>
  std::vector<std::vector<float>> theirs(Scene& scene, Estimator& estimator) {
    estimator.setInputCloud(test::pcl_points(*scene.surface));
    estimator.setInputNormals(test::pcl_normals(*scene.surface));
    estimator.setSearchMethod(
        pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>));
    estimator.setRadiusSearch(scene.radius_m);
    estimator.setIndices(pcl::IndicesPtr(new pcl::Indices(scene.points)));
    pcl::PointCloud<Histogram> found;
    estimator.compute(found);
    std::vector<std::vector<float>> rows;
    for (const Histogram& point : found) {
      rows.emplace_back(std::begin(point.histogram), std::end(point.histogram));
    }
    return rows;
  }

  static void expect_near(const std::vector<std::vector<float>>& ours,
                          const std::vector<std::vector<float>>& theirs, double share) {
    ASSERT_EQ(ours.size(), theirs.size());
    double off = 0.0;
    double all = 0.0;
    for (std::size_t row = 0; row < ours.size(); ++row) {
      ASSERT_EQ(ours[row].size(), theirs[row].size());
      for (std::size_t bin = 0; bin < ours[row].size(); ++bin) {
        const auto a = static_cast<double>(ours[row][bin]);
        const auto b = static_cast<double>(theirs[row][bin]);
        off += std::fabs(a - b);
        all += std::fabs(b);
      }
    }
    EXPECT_GT(all, 0.0);
    EXPECT_LT(off / all, share);
  }
};

INSTANTIATE_TEST_SUITE_P(BothEngines, DescriptorsAgainstPcl,
                         testing::Values(Engine::Fast, Engine::Reference), [](const auto& engine) {
                           return engine.param == Engine::Fast ? "Fast" : "Reference";
                         });

// PCL adds single precision; pairs on a bin's border fall on either side: under 2 in a thousand.
constexpr double kBorderPairs = 0.002;

TEST_P(DescriptorsAgainstPcl, FastPointFeatureHistogramsAreTheSame) {
  std::vector<Scene> all = scenes();
  for (Scene& scene : all) {
    pcl::FPFHEstimation<pcl::PointXYZ, pcl::Normal, pcl::FPFHSignature33> estimator;
    expect_near(ours<FpfhEstimator>(scene, FpfhParams{}),
                theirs<pcl::FPFHSignature33>(scene, estimator), kBorderPairs);
  }
}

TEST_P(DescriptorsAgainstPcl, PointFeatureHistogramsAreTheSame) {
  std::vector<Scene> all = scenes();
  for (Scene& scene : all) {
    pcl::PFHEstimation<pcl::PointXYZ, pcl::Normal, pcl::PFHSignature125> estimator;
    expect_near(ours<PfhEstimator>(scene, PfhParams{}),
                theirs<pcl::PFHSignature125>(scene, estimator), kBorderPairs);
  }
}

TEST_P(DescriptorsAgainstPcl, SpinImagesOfAllFourKindsAreTheSame) {
  std::vector<Scene> all = scenes();
  for (Scene& scene : all) {
    for (const SpinStructure structure : {SpinStructure::Rectangular, SpinStructure::Radial}) {
      for (const SpinDomain domain : {SpinDomain::Density, SpinDomain::Angular}) {
        pcl::SpinImageEstimation<pcl::PointXYZ, pcl::Normal, pcl::Histogram<153>> estimator(8, 0.5,
                                                                                            0);
        estimator.setRadialStructure(structure == SpinStructure::Radial);
        estimator.setAngularDomain(domain == SpinDomain::Angular);
        SpinImageParams params;
        params.min_cos = 0.5;
        params.structure = structure;
        params.domain = domain;
        // Votes are shared between cells, so that rounding moves little.
        expect_near(ours<SpinImageEstimator>(scene, params),
                    theirs<pcl::Histogram<153>>(scene, estimator), 0.001);
      }
    }
  }
}

}  // namespace
}  // namespace grapnel
