// Metrics and rejectors against PCL's on the same rows and pairs.
#include <gtest/gtest.h>
#include <pcl/common/norms.h>
#include <pcl/registration/correspondence_rejection_distance.h>
#include <pcl/registration/correspondence_rejection_median_distance.h>
#include <pcl/registration/correspondence_rejection_one_to_one.h>
#include <pcl/registration/correspondence_rejection_trimmed.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "base/rng.h"
#include "pipeline/correspond/metric.h"
#include "pipeline/reject/distance.h"
#include "pipeline/reject/median.h"
#include "pipeline/reject/one_to_one.h"
#include "pipeline/reject/trimmed.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

constexpr int kBins = 33;
using Row = std::vector<float>;

double ours(Metric metric, const Row& a, const Row& b, const MetricFactors& factors = {}) {
  const std::vector<double> x(a.begin(), a.end());
  const std::vector<double> y(b.begin(), b.end());
  return metric_distance(metric, x, y, factors);
}

TEST(MetricsAgainstPcl, AreTheSameOnRowsWithEmptyBins) {
  Rng rng(12);
  const auto random_row = [&] {
    Row row(kBins);
    for (float& value : row) {
      value = rng.uniform() < 0.2 ? 0.0F : static_cast<float>(rng.uniform(0.0, 30.0));
    }
    return row;
  };
  const std::array<std::pair<Metric, pcl::NormType>, 10> same = {{
      {Metric::L1, pcl::L1},
      {Metric::L2Squared, pcl::L2_SQR},
      {Metric::L2, pcl::L2},
      {Metric::LInfinity, pcl::LINF},
      {Metric::JeffriesMatusita, pcl::JM},
      {Metric::Bhattacharyya, pcl::B},
      {Metric::Sublinear, pcl::SUBLINEAR},
      {Metric::ChiSquare, pcl::CS},
      {Metric::Divergence, pcl::DIV},
      {Metric::KullbackLeibler, pcl::KL},
  }};
  for (int round = 0; round < 50; ++round) {
    const Row a = random_row();
    const Row b = random_row();
    // PCL sums 33 floats: some units of the sixth digit.
    const auto close = [](double x, double y, int type) {
      if (std::isinf(x) && std::isinf(y)) return;
      EXPECT_NEAR(x, y, 1e-5 * (10.0 + std::fabs(y))) << type;
    };
    for (const auto& [metric, norm] : same) {
      close(ours(metric, a, b), static_cast<double>(pcl::selectNorm<Row>(a, b, kBins, norm)), norm);
    }
    close(1.0 - ours(Metric::Intersection, a, b),
          static_cast<double>(pcl::HIK_Norm<Row>(a, b, kBins)), pcl::HIK);
    close(ours(Metric::Pf, a, b, {1.5, 0.5}),
          static_cast<double>(pcl::PF_Norm<Row>(a, b, kBins, 1.5F, 0.5F)), pcl::PF);
    close(ours(Metric::K, a, b, {1.5, 0.5}),
          static_cast<double>(pcl::K_Norm<Row>(a, b, kBins, 1.5F, 0.5F)), pcl::K);
  }
}

class RejectorsAgainstPcl : public testing::Test {
 protected:
  RejectorsAgainstPcl() {
    Rng rng(4);
    for (int i = 0; i < 301; ++i) {
      const auto target = static_cast<int>(rng.below(100));
      const auto distance = static_cast<float>(rng.uniform());
      given_->emplace_back(i, target, distance);
      pairs_.push_back({i, target, distance});
    }
  }
  using Pairs = std::vector<std::pair<int, int>>;

  /// Sorted: PCL changes the order in two of them.
  template <class Rejector>
  Pairs theirs(Rejector& rejector) {
    pcl::Correspondences kept;
    rejector.setInputCorrespondences(given_);
    rejector.getCorrespondences(kept);
    Pairs list;
    for (const pcl::Correspondence& pair : kept)
      list.emplace_back(pair.index_query, pair.index_match);
    std::sort(list.begin(), list.end());
    return list;
  }
  template <class Rejector>
  Pairs ours(Rejector rejector) {
    const test::ArenaMemory memory([&](Arena& arena) { rejector.reserve(arena, Limits{}); });
    Rng rng(1);
    EXPECT_TRUE(rejector.reject({}, pairs_, rng).ok());
    Pairs list;
    for (const Correspondence& pair : pairs_) list.emplace_back(pair.source, pair.target);
    return list;
  }

  pcl::CorrespondencesPtr given_{new pcl::Correspondences};
  std::vector<Correspondence> storage_ = std::vector<Correspondence>(301);
  Correspondences pairs_{storage_};
};

TEST_F(RejectorsAgainstPcl, KeepTheSameByDistance) {
  pcl::registration::CorrespondenceRejectorDistance rejector;
  rejector.setMaximumDistance(0.6F);
  EXPECT_EQ(ours(DistanceRejector({static_cast<double>(0.6F * 0.6F)})), theirs(rejector));
}

TEST_F(RejectorsAgainstPcl, KeepTheSameByMedian) {
  pcl::registration::CorrespondenceRejectorMedianDistance rejector;
  rejector.setMedianFactor(0.7);
  EXPECT_EQ(ours(MedianRejector({0.7})), theirs(rejector));
}

TEST_F(RejectorsAgainstPcl, KeepTheSameOneToOne) {
  pcl::registration::CorrespondenceRejectorOneToOne rejector;
  EXPECT_EQ(ours(OneToOneRejector({})), theirs(rejector));
}

TEST_F(RejectorsAgainstPcl, KeepTheSameTrimmed) {
  pcl::registration::CorrespondenceRejectorTrimmed rejector;
  rejector.setOverlapRatio(0.37F);
  EXPECT_EQ(ours(TrimmedRejector({0.37, 0})), theirs(rejector));
}

}  // namespace
}  // namespace grapnel
