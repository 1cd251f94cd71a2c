#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "base/math.h"
#include "base/rng.h"
#include "pipeline/descriptors/pair_feature.h"
#include "pipeline/kernels/median_row.h"
#include "pipeline/kernels/pair_features.h"
#include "pipeline/kernels/reference.h"
#include "pipeline/kernels/target.h"
#include "pipeline/kernels/within.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

/// Every test runs on each target that this machine has, and must give the same bits as the plain
/// loops of reference.h.
class Kernel : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, Kernel, testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

template <class T>
void expect_same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  ASSERT_EQ(a.size(), b.size());
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(T)), 0);
}

TEST(KernelTargets, CanBeForcedByName) {
  for (const std::string& name : kernels::target_names()) {
    ASSERT_TRUE(kernels::force_target(name));
    EXPECT_EQ(kernels::target_name(), name);
  }
  EXPECT_TRUE(kernels::force_target(""));
  EXPECT_EQ(kernels::target_name(), kernels::target_names().front());
  EXPECT_FALSE(kernels::force_target("NO_SUCH_TARGET"));
  EXPECT_EQ(kernels::target_name(), kernels::target_names().front());
}

/// Padded rows of random depths; `gaps` of them are 0.
struct Rows {
  std::vector<std::vector<std::uint16_t>> memory;
  std::array<const std::uint16_t*, 5> pointers{};
  Rows(std::size_t count, std::size_t width, double gaps, Rng& rng) {
    for (std::size_t r = 0; r < count; ++r) {
      std::vector<std::uint16_t> row(width + 4 + kernels::kDepthSlack, 0);
      for (std::size_t u = 0; u < width + 4; ++u) {
        if (rng.uniform() < gaps) continue;
        row[u] = static_cast<std::uint16_t>(800 + rng.below(rng.uniform() < 0.1 ? 60000 : 40));
      }
      memory.push_back(row);
    }
    for (std::size_t r = 0; r < count; ++r) pointers[r] = memory[r].data();
  }
};

TEST_P(Kernel, MedianOfRowsEqualsTheSortedReadings) {
  Rng rng(11);
  for (const int window : {3, 5}) {
    for (const std::size_t width : {1U, 7U, 16U, 33U, 100U, 241U, 300U}) {
      for (const double gaps : {0.0, 0.02, 0.5, 1.0}) {
        const Rows rows(static_cast<std::size_t>(window), width, gaps, rng);
        std::vector<std::uint16_t> out(width, 1);
        std::vector<std::uint16_t> expected(width, 2);
        kernels::median_row(rows.pointers.data(), window, width, out.data());
        kernels::reference::median_row(rows.pointers.data(), window, width, expected.data());
        EXPECT_EQ(out, expected) << window << "x" << window << " width " << width;
      }
    }
  }
}

TEST_P(Kernel, SupportOfRowsEqualsThePlainCount) {
  Rng rng(12);
  for (const std::size_t width : {1U, 15U, 16U, 61U}) {
    for (const double gaps : {0.0, 0.3}) {
      for (const int needed : {0, 4, 8}) {
        const Rows rows(3, width, gaps, rng);
        const kernels::GapLaw law{0.01F, 1e-5F};
        std::vector<std::uint16_t> out(width, 1);
        std::vector<std::uint16_t> expected(width, 2);
        const std::size_t removed = kernels::support_row(
            rows.pointers[0], rows.pointers[1], rows.pointers[2], law, needed, width, out.data());
        EXPECT_EQ(removed, kernels::reference::support_row(rows.pointers[0], rows.pointers[1],
                                                           rows.pointers[2], law, needed, width,
                                                           expected.data()));
        EXPECT_EQ(out, expected);
      }
    }
  }
}

TEST_P(Kernel, BackProjectionHasTheSameBitsAsPlainLoops) {
  Rng rng(13);
  const std::size_t width = 77;
  const Rows rows(1, width, 0.2, rng);
  const kernels::RowCamera camera{0.001F, 1.0F / 525.0F, 38.2F, -0.123F};
  std::array<std::vector<float>, 3> out;
  std::array<std::vector<float>, 3> expected;
  for (auto* planes : {&out, &expected}) {
    for (auto& plane : *planes) plane.assign(width + kernels::kDepthSlack, 0.0F);
  }
  kernels::back_project_row(rows.pointers[0], camera, width, out[0].data(), out[1].data(),
                            out[2].data());
  kernels::reference::back_project_row(rows.pointers[0], camera, width, expected[0].data(),
                                       expected[1].data(), expected[2].data());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    out[axis].resize(width);
    expected[axis].resize(width);
    expect_same_bits(out[axis], expected[axis]);
  }
}

TEST_P(Kernel, SelectionWithinASphereHasTheSameBitsAsPlainLoops) {
  Rng rng(14);
  const std::size_t count = 500;
  std::array<std::vector<float>, 3> p;
  for (auto& plane : p) {
    plane.assign(count + kernels::kSlack, 0.0F);
    for (std::size_t i = 0; i < count; ++i) plane[i] = static_cast<float>(rng.uniform());
  }
  const kernels::PointPlanes points{p[0].data(), p[1].data(), p[2].data()};
  const std::vector<PointRange> ranges = {{0, 1}, {5, 5}, {7, 300}, {300, 499}, {499, 500}};
  for (const float squared : {0.0F, 0.01F, 0.2F, 9.0F}) {
    const kernels::Sphere sphere{p[0][9], p[1][9], p[2][9], squared};
    std::vector<std::int32_t> index(count + kernels::kSlack);
    std::vector<std::int32_t> expected_index(count + kernels::kSlack);
    std::vector<float> distance(count + kernels::kSlack);
    std::vector<float> expected_distance(count + kernels::kSlack);
    const std::size_t found =
        kernels::select_within(points, ranges, sphere, index.data(), distance.data());
    ASSERT_EQ(found, kernels::reference::select_within(
                         points, ranges, sphere, expected_index.data(), expected_distance.data()));
    for (auto* list : {&index, &expected_index}) list->resize(found);
    for (auto* list : {&distance, &expected_distance}) list->resize(found);
    EXPECT_EQ(index, expected_index);
    expect_same_bits(distance, expected_distance);
    kernels::PartialMoments partial{};
    kernels::PartialMoments plain{};
    for (int twice = 0; twice < 2; ++twice) {
      kernels::add_sphere_moments(points, ranges, sphere, partial);
      kernels::reference::add_sphere_moments(points, ranges, sphere, plain);
    }
    EXPECT_EQ(std::memcmp(&partial, &plain, sizeof partial), 0);
    EXPECT_EQ(kernels::fold(partial).count, static_cast<float>(2 * found));
  }
}

/// A bumpy sphere's points with outward normals, and two coincident points at its end.
test::OwnedSurface oriented_points() {
  test::OwnedSurface surface = test::sphere(300, 0.1, true);
  Rng rng(15);
  for (std::size_t i = 0; i < surface->size; ++i) {
    surface->x[i] += static_cast<float>(0.01 * rng.normal());
  }
  const std::size_t last = surface->size - 1;
  surface->x[last] = surface->x[0];
  surface->y[last] = surface->y[0];
  surface->z[last] = surface->z[0];
  return surface;
}

std::vector<float> rows_of(const Surface& s) {
  std::vector<float> rows;
  for (std::size_t i = 0; i < s.size; ++i) {
    rows.insert(rows.end(), {s.x[i], s.y[i], s.z[i], s.nx[i], s.ny[i], s.nz[i], 0.0F, 0.0F});
  }
  return rows;
}

TEST_P(Kernel, PairBinsAreThoseOfPlainLoops) {
  test::OwnedSurface surface = oriented_points();
  std::vector<std::int32_t> others;
  for (std::int32_t i = 1; i < static_cast<std::int32_t>(surface->size); ++i) others.push_back(i);
  std::vector<std::int32_t> bins(others.size() + 8);
  std::vector<std::int32_t> expected(others.size() + 8);
  kernels::pair_bins(rows_of(*surface).data(), 0, others, bins.data());
  kernels::reference::pair_bins(rows_of(*surface).data(), 0, others, expected.data());
  bins.resize(others.size());
  expected.resize(others.size());
  EXPECT_EQ(bins, expected);
  EXPECT_EQ(bins.back(), kernels::kNoPair);
}

TEST(PairBins, AgreeWithDoublePrecisionAwayFromTheBordersOfBins) {
  test::OwnedSurface surface = oriented_points();
  std::vector<std::int32_t> others;
  for (std::int32_t i = 1; i < static_cast<std::int32_t>(surface->size); ++i) others.push_back(i);
  std::vector<std::int32_t> bins(others.size() + 8);
  kernels::pair_bins(rows_of(*surface).data(), 0, others, bins.data());
  // A place within this of a bin's border may fall on either side: float arithmetic and an arc
  // tangent right to 1e-5, in units of a bin.
  constexpr double kBorder = 1e-4;
  std::size_t compared = 0;
  for (std::size_t k = 0; k + 1 < others.size(); ++k) {
    const auto other = static_cast<std::size_t>(others[k]);
    const PairFeature f =
        pair_feature(surface->point(0).cast<double>(), surface->normal(0).cast<double>(),
                     surface->point(other).cast<double>(), surface->normal(other).cast<double>());
    ASSERT_TRUE(f.valid);
    const std::array<double, 3> places = {11.0 * (f.f1_rad + math::kPi) / (2.0 * math::kPi),
                                          11.0 * (f.f2 + 1.0) / 2.0, 11.0 * (f.f3 + 1.0) / 2.0};
    for (unsigned i = 0; i < 3; ++i) {
      if (std::fabs(places[i] - std::round(places[i])) < kBorder) continue;
      EXPECT_EQ((bins[k] >> (8 * i)) & 0xff, static_cast<int>(std::floor(places[i])));
      ++compared;
    }
  }
  EXPECT_GT(compared, 800U);
}

}  // namespace
}  // namespace grapnel
