#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/kernels/reference.h"
#include "pipeline/kernels/target.h"
#include "pipeline/neighbours/symmetric3.h"

namespace grapnel {
namespace {

constexpr int kWidth = 80;
constexpr int kHeight = 40;
constexpr std::size_t kPixels = static_cast<std::size_t>(kWidth) * kHeight;
constexpr std::size_t kRoom = kPixels + 64;
constexpr std::size_t kBlock = kernels::kRangeBlock;

/// Every test runs on each target that this machine has, against the plain loops: the same bits.
class RangeKernel : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(kernels::force_target(GetParam())); }
  void TearDown() override { ASSERT_TRUE(kernels::force_target("")); }
};

INSTANTIATE_TEST_SUITE_P(OnEveryTarget, RangeKernel, testing::ValuesIn(kernels::target_names()),
                         [](const auto& target) { return target.param; });

float number(double value) { return static_cast<float>(value); }

/// A sheet 1 m away with a step, holes and far pixels.
struct Image {
  std::vector<float> x, y, z, range;
  std::vector<std::int32_t> point;
  std::vector<std::uint8_t> state;

  Image() : x(kRoom), y(kRoom), z(kRoom), range(kRoom), point(kRoom, -1), state(kRoom) {
    Rng rng(41);
    for (std::size_t i = 0; i < kRoom; ++i) {
      const double u = static_cast<double>(i % kWidth);
      const double v = static_cast<double>(i / kWidth);
      const double depth = 1.0 + 0.002 * u + (u > 40.0 ? 0.05 : 0.0) + 0.001 * rng.normal();
      const double chance = rng.uniform();
      state[i] = chance < 0.2 ? std::uint8_t{2} : std::uint8_t{0};
      x[i] = number(0.004 * (u - 40.0) * depth);
      y[i] = number(0.004 * (v - 20.0) * depth);
      z[i] = number(depth);
      point[i] = chance > 0.7 ? -1 : static_cast<std::int32_t>(i);
      if (chance < 0.8) continue;
      x[i] = chance > 0.9 ? 2e15F : 1e15F;
      y[i] = z[i] = 0.0F;
    }
  }
  [[nodiscard]] kernels::RangePlanes planes() const {
    return {x.data(), y.data(), z.data(), kWidth};
  }
};

TEST_P(RangeKernel, RangesAreThoseOfPlainLoops) {
  const Image image;
  constexpr std::ptrdiff_t kCount = 101;
  std::vector<float> found(kRoom);
  std::vector<float> expected(kRoom);
  std::array<float, 2> ends = {1e15F, 0.0F};
  std::array<float, 2> expected_ends = ends;
  kernels::ranges(image.planes(), kCount, found.data(), &ends[0], &ends[1]);
  kernels::reference::ranges(image.planes(), kCount, expected.data(), &expected_ends[0],
                             &expected_ends[1]);
  EXPECT_EQ(ends, expected_ends);
  found.resize(kCount);
  expected.resize(kCount);
  EXPECT_EQ(found, expected);
}

TEST_P(RangeKernel, HalvesAreThoseOfPlainLoops) {
  Image image;
  std::array<float, 2> ends = {1e15F, 0.0F};
  kernels::reference::ranges(image.planes(), kRoom, image.range.data(), &ends[0], &ends[1]);
  const kernels::RangeRow from{image.x.data(), image.y.data(), image.z.data(), image.range.data(),
                               image.point.data()};
  Image found;
  Image expected;
  for (Image* to : {&found, &expected}) {
    const kernels::MutableRangeRow out{to->x.data(), to->y.data(), to->z.data(), to->range.data(),
                                       to->point.data()};
    if (to == &found) {
      kernels::halve_row(from, kWidth, kWidth / 2, out);
    } else {
      kernels::reference::halve_row(from, kWidth, kWidth / 2, out);
    }
  }
  for (std::size_t i = 0; i < kWidth / 2; ++i) {
    EXPECT_EQ(found.x[i], expected.x[i]) << i;
    EXPECT_EQ(found.z[i], expected.z[i]) << i;
    EXPECT_EQ(found.range[i], expected.range[i]) << i;
    EXPECT_EQ(found.point[i], expected.point[i]) << i;
  }
}

TEST_P(RangeKernel, NormalsFaceTheCameraAsInPlainLoops) {
  const Image image;
  Rng rng(43);
  for (std::size_t first = 0; first + kBlock < kPixels; first += kBlock) {
    std::array<std::array<float, kBlock>, 4> found;
    for (std::size_t lane = 0; lane < kBlock; ++lane) {
      const bool flat = rng.uniform() < 0.1;
      for (std::size_t k = 0; k < 3; ++k) found[k][lane] = flat ? 0.0F : number(rng.normal());
      found[3][lane] = rng.uniform() < 0.1 ? 1e30F : 1e-4F;
    }
    std::array<std::array<float, kBlock>, 4> expected = found;
    const auto at = static_cast<std::ptrdiff_t>(first);
    const std::uint32_t missing = kernels::face_camera(
        image.planes(), at, {found[0].data(), found[1].data(), found[2].data()}, found[3].data());
    EXPECT_EQ(missing,
              kernels::reference::face_camera(
                  image.planes(), at, {expected[0].data(), expected[1].data(), expected[2].data()},
                  expected[3].data()));
    EXPECT_EQ(found, expected) << first;
  }
}

TEST_P(RangeKernel, SmoothedScoresAreThoseOfPlainLoops) {
  Rng rng(47);
  std::vector<float> scores(kRoom);
  for (float& score : scores)
    score = rng.uniform() < 0.3 ? 0.0F : number(2.0 * rng.uniform() - 1.0);
  for (std::ptrdiff_t at = kWidth + 1; at < kWidth * (kHeight - 2); at += 7) {
    std::array<float, kBlock> found{};
    std::array<float, kBlock> expected{};
    kernels::smooth_scores(scores.data(), at, kWidth, 0.8F, found.data());
    kernels::reference::smooth_scores(scores.data(), at, kWidth, 0.8F, expected.data());
    EXPECT_EQ(found, expected) << at;
  }
}

TEST_P(RangeKernel, OpenPixelsAreThoseOfPlainLoops) {
  const Image image;
  for (const kernels::PixelWindow& window :
       {kernels::PixelWindow{21, 21, 10, 10}, {63, 31, 1, 30}, {5, 40, 3, 2}, {17, 9, 0, 0}}) {
    std::array<std::uint64_t, kHeight> found{};
    std::array<std::uint64_t, kHeight> expected{};
    const kernels::Sphere sphere{0.0F, 0.0F, 1.05F, 0.04F * 0.04F};
    kernels::open_pixels(image.planes(), image.state.data(), 0, window, sphere, found.data());
    kernels::reference::open_pixels(image.planes(), image.state.data(), 0, window, sphere,
                                    expected.data());
    EXPECT_EQ(found, expected) << window.columns;
  }
}

/// Changes of three rows of a sheet, in directions all around.
struct Changes {
  static constexpr std::int32_t kRow = 37;
  std::vector<std::int32_t> u;
  std::array<std::vector<float>, 7> plane;
  std::vector<kernels::ChangeRow> rows;

  Changes() {
    Rng rng(53);
    for (std::int32_t row = -1; row <= 3; row += 2) {
      rows.push_back({{static_cast<std::int32_t>(u.size()), 0}, row, rng.next_u64()});
      for (std::int32_t i = 0; i < kRow; ++i) {
        u.push_back(3 + i);
        const Vec3d direction = Vec3d(rng.normal(), rng.normal(), rng.normal()).normalized();
        const std::array<double, 7> values = {0.004 * i - 0.08, 0.004 * row,   1.0,
                                              direction.x(),    direction.y(), direction.z(),
                                              rng.uniform()};
        for (std::size_t k = 0; k < values.size(); ++k) plane[k].push_back(number(values[k]));
      }
      rows.back().range.end = static_cast<std::int32_t>(u.size());
    }
    u.resize(u.size() + kernels::kSlack);
    for (std::vector<float>& values : plane) values.resize(u.size());
  }
  [[nodiscard]] kernels::ChangePlanes planes() const {
    return {u.data(),        plane[0].data(), plane[1].data(), plane[2].data(),
            plane[3].data(), plane[4].data(), plane[5].data(), plane[6].data()};
  }
};

kernels::ChangeView view_of_changes() {
  kernels::ChangeView view;
  view.z = 1.0F;
  view.across_x = -0.6F;
  view.across_z = 0.8F;
  view.up_x = 0.48F;
  view.up_y = 0.8F;
  view.up_z = 0.36F;
  view.squared_m2 = 0.05F * 0.05F;
  view.per_radius = 20.0F;
  view.per_optimal = 4.0F;
  view.least = 0.05F;
  view.u = 23;
  return view;
}

TEST_P(RangeKernel, VotesAndTheirSpreadAreThoseOfPlainLoops) {
  const Changes changes;
  for (const bool every_column : {true, false}) {
    kernels::ChangeView view = view_of_changes();
    view.every_column = every_column;
    kernels::ChangeVotes found;
    kernels::ChangeVotes expected;
    kernels::add_votes(changes.planes(), changes.rows, view, found);
    kernels::reference::add_votes(changes.planes(), changes.rows, view, expected);
    EXPECT_EQ(found.calm, expected.calm);
    EXPECT_LT(found.calm, 1.0F);
    EXPECT_EQ(0, std::memcmp(found.cell, expected.cell, sizeof found.cell));
    EXPECT_EQ(kernels::spread_of(found), kernels::reference::spread_of(expected));
    EXPECT_GT(kernels::spread_of(found), 0.2F);
  }
}

/// Covariances of points on slanted sheets with noise: smallest and largest far from the middle.
struct Covariances {
  static constexpr std::size_t kCount = 512;
  std::array<std::vector<float>, 6> entry;
  std::vector<Symmetric3> matrix;

  Covariances() {
    Rng rng(59);
    for (std::vector<float>& values : entry) values.assign(kCount + kernels::kVectorBlock, 0.0F);
    for (std::size_t i = 0; i < kCount; ++i) {
      const Vec3d a = Vec3d(rng.normal(), rng.normal(), rng.normal()).normalized();
      const Vec3d b = a.unitOrthogonal();
      const Vec3d c = a.cross(b);
      const double scale = 1e-6 + 1e-3 * rng.uniform();
      const double flat = 0.2 * rng.uniform();
      Mat3d m = flat * a * a.transpose() + c * c.transpose() +
                (flat + 0.05 + rng.uniform() * (0.9 - flat)) * b * b.transpose();
      m *= scale * scale;
      const std::array<double, 6> values = {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)};
      for (std::size_t k = 0; k < 6; ++k) entry[k][i] = number(values[k]);
      const auto rounded = [&](std::size_t k) { return static_cast<double>(entry[k][i]); };
      matrix.push_back({rounded(0), rounded(1), rounded(2), rounded(3), rounded(4), rounded(5)});
    }
  }
  [[nodiscard]] kernels::SymmetricPlanes planes() const {
    return {entry[0].data(), entry[1].data(), entry[2].data(),
            entry[3].data(), entry[4].data(), entry[5].data()};
  }
};

TEST_P(RangeKernel, EigenvectorsAreThoseOfRotationsInDouble) {
  const Covariances covariances;
  constexpr std::size_t kRows = Covariances::kCount + kernels::kVectorBlock;
  using Rows = std::array<std::vector<float>, 7>;
  const auto run = [&](Rows& rows) {
    for (std::vector<float>& values : rows) values.assign(kRows, 0.0F);
    kernels::smallest_eigenvectors(covariances.planes(), Covariances::kCount,
                                   {rows[0].data(), rows[1].data(), rows[2].data()});
    kernels::largest_eigenvectors(covariances.planes(), Covariances::kCount, rows[3].data(),
                                  {rows[4].data(), rows[5].data(), rows[6].data()});
  };
  Rows found;
  run(found);
  Rows first;
  ASSERT_TRUE(kernels::force_target(kernels::target_names().front()));
  run(first);
  for (std::size_t i = 0; i < Covariances::kCount; ++i) {
    for (std::size_t k = 0; k < 7; ++k) ASSERT_EQ(found[k][i], first[k][i]);
    const Eigen3 expected = eigen_symmetric3(covariances.matrix[i]);
    const Vec3d smallest = Vec3f(found[0][i], found[1][i], found[2][i]).cast<double>();
    const Vec3d largest = Vec3f(found[4][i], found[5][i], found[6][i]).cast<double>();
    // Neighbouring eigenvalues are at least a twentieth of the largest apart: 24 bits lose five.
    EXPECT_LT(smallest.cross(expected.vectors.col(0)).norm(), 1e-4) << i;
    EXPECT_LT(largest.cross(expected.vectors.col(2)).norm(), 1e-4) << i;
    EXPECT_NEAR(static_cast<double>(found[3][i]), std::sqrt(expected.values[2]),
                1e-5 * std::sqrt(expected.values[2]));
  }
}

TEST_P(RangeKernel, EigenvectorsOfEqualEigenvaluesAreLeftToTheCaller) {
  std::array<float, kernels::kVectorBlock> on{};
  std::array<float, kernels::kVectorBlock> off{};
  on.fill(0.01F);
  on[3] = 0.0F;
  std::array<std::array<float, kernels::kVectorBlock>, 3> found;
  kernels::smallest_eigenvectors(
      {on.data(), off.data(), off.data(), on.data(), off.data(), on.data()}, kernels::kVectorBlock,
      {found[0].data(), found[1].data(), found[2].data()});
  for (const auto& values : found) {
    for (const float value : values) EXPECT_EQ(value, 0.0F);
  }
}

}  // namespace
}  // namespace grapnel
