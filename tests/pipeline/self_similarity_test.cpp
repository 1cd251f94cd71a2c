#include "pipeline/self_similarity.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <cmath>

#include "base/cloud.h"
#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

constexpr double kStep_m = 0.008;

/// A box's faces in points 8 mm apart, and a block on its top where wanted: half way to one corner,
/// or to the middle of one edge.
CloudData box_with_block(const Vec3d& size_m, double block_m, bool at_corner) {
  CloudData cloud;
  const Vec3d half = 0.5 * size_m;
  const auto add = [&cloud](const Vec3d& p, int axis, double side) {
    cloud.x.push_back(static_cast<float>(p.x()));
    cloud.y.push_back(static_cast<float>(p.y()));
    cloud.z.push_back(static_cast<float>(p.z()));
    cloud.nx.push_back(axis == 0 ? static_cast<float>(side) : 0.0F);
    cloud.ny.push_back(axis == 1 ? static_cast<float>(side) : 0.0F);
    cloud.nz.push_back(axis == 2 ? static_cast<float>(side) : 0.0F);
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int b = (axis + 1) % 3;
    const int c = (axis + 2) % 3;
    for (double s = -half[b] + 0.5 * kStep_m; s < half[b]; s += kStep_m) {
      for (double t = -half[c] + 0.5 * kStep_m; t < half[c]; t += kStep_m) {
        for (const double side : {-1.0, 1.0}) {
          Vec3d p;
          p[axis] = side * half[axis];
          p[b] = s;
          p[c] = t;
          const bool on_block =
              axis == 2 && side > 0.0 && std::fabs(p.x() + 0.5 * half.x()) < 0.3 * half.x() &&
              std::fabs(p.y() + (at_corner ? 0.5 : 0.0) * half.y()) < 0.3 * half.y();
          if (on_block) p.z() += block_m;
          add(p, axis, side);
        }
      }
    }
  }
  cloud.width = static_cast<int>(cloud.size());
  return cloud;
}

/// A part and what find_siblings() says of it.
class Part {
 public:
  Part(const Vec3d& size_m, double block_m, Symmetry symmetry, bool at_corner = true)
      : surface_(test::surface_of(box_with_block(size_m, block_m, at_corner))),
        memory_([this](Arena& arena) {
          table_.reserve(arena, 200000);
          siblings_ = FixedList<Sibling>(arena.take<Sibling>(12));
          mirrored_ = FixedList<Sibling>(arena.take<Sibling>(12));
        }) {
    surface_->spacing_m = kStep_m;
    table_.build(*surface_, 0.15 * size_m.norm());
    find_siblings(*surface_, table_, Vec3d::Zero(), size_m.norm(), symmetry, siblings_);
    find_mirrored_siblings({*surface_, table_, true}, *surface_, table_, Vec3d::Zero(),
                           size_m.norm(), symmetry, mirrored_);
  }

  [[nodiscard]] const FixedList<Sibling>& siblings() const { return siblings_; }
  [[nodiscard]] const FixedList<Sibling>& mirrored() const { return mirrored_; }
  /// The share of the mirrored sibling that is the reflection along `axis`, 0 when there is none.
  [[nodiscard]] double reflection(int axis) const {
    Mat3d reflection = Mat3d::Identity();
    reflection(axis, axis) = -1.0;
    for (const Sibling& sibling : mirrored_) {
      // Within 3 degrees.
      if ((sibling.motion.linear().transpose() * reflection).trace() > 2.997) return sibling.share;
    }
    return 0.0;
  }
  /// The share of the sibling that is the half turn about `axis`, 0 when there is none.
  [[nodiscard]] double half_turn(int axis) const {
    Mat3d turn = -Mat3d::Identity();
    turn(axis, axis) = 1.0;
    for (const Sibling& sibling : siblings_) {
      // Within 3 degrees.
      if ((sibling.motion.linear().transpose() * turn).trace() > 2.997) return sibling.share;
    }
    return 0.0;
  }

 private:
  test::OwnedSurface surface_;
  ClosestPointTable table_;
  FixedList<Sibling> siblings_;
  FixedList<Sibling> mirrored_;
  test::ArenaMemory memory_;
};

TEST(SelfSimilarity, ABoxWithoutDeclaredSymmetryHasItsThreeHalfTurns) {
  const Part box({0.4, 0.3, 0.2}, 0.0, Symmetry::None);
  EXPECT_EQ(box.siblings().size(), 3U);
  // At the edges the nearest point may be one of the next face: 5 % of the surface.
  for (int axis = 0; axis < 3; ++axis) EXPECT_GT(box.half_turn(axis), 0.95) << axis;
}

TEST(SelfSimilarity, WhatIsDeclaredIsNoSibling) {
  const Part box({0.4, 0.3, 0.2}, 0.0, Symmetry::Box);
  for (const Sibling& sibling : box.siblings()) {
    ADD_FAILURE() << sibling.share << "\n" << sibling.motion.matrix();
  }
}

TEST(SelfSimilarity, ABlockOnTopTellsTheHalfTurnsApartByItsShareOfTheSurface) {
  const Part part({0.4, 0.3, 0.2}, 0.03, Symmetry::None);
  // The block is 0.3 x 0.3 of the top, the top 0.12 of 0.52 m²: 2 % there and 2 % where it is
  // carried to, and what its edges add.
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GT(part.half_turn(axis), 0.90) << axis;
    EXPECT_LT(part.half_turn(axis), 0.985) << axis;
  }
}

/// Ten ribs 20 mm high across a strip, one every 40 mm along x; seen from above.
CloudData ribbed_strip(double pitch_m) {
  constexpr double kLine_m = 0.004;
  constexpr double kHigh_m = 0.02;
  CloudData cloud;
  const auto add = [&](double x, double y, double z, float nx, float nz) {
    cloud.x.push_back(static_cast<float>(x));
    cloud.y.push_back(static_cast<float>(y));
    cloud.z.push_back(static_cast<float>(z));
    cloud.nx.push_back(nx);
    cloud.ny.push_back(0.0F);
    cloud.nz.push_back(nz);
  };
  for (int rib = -5; rib < 5; ++rib) {
    const double x = rib * pitch_m;
    for (double y = -0.05; y < 0.05; y += kLine_m) {
      for (double along = 0.5 * kLine_m; along < pitch_m; along += kLine_m) {
        add(x + along, y, along < 0.5 * pitch_m ? kHigh_m : 0.0, 0.0F, 1.0F);
      }
      for (double z = 0.5 * kLine_m; z < kHigh_m; z += kLine_m) {
        add(x, y, z, -1.0F, 0.0F);
        add(x + 0.5 * pitch_m, y, z, 1.0F, 0.0F);
      }
    }
  }
  cloud.width = static_cast<int>(cloud.size());
  return cloud;
}

TEST(SelfSimilarity, AShiftByOneRibIsASibling) {
  constexpr double kPitch_m = 0.04;
  test::OwnedSurface strip = test::surface_of(ribbed_strip(kPitch_m));
  strip->spacing_m = 0.004;
  const double diameter_m = Vec3d(0.4, 0.1, 0.02).norm();
  ClosestPointTable table;
  FixedList<Sibling> siblings;
  const test::ArenaMemory memory([&](Arena& arena) {
    table.reserve(arena, 200000);
    siblings = FixedList<Sibling>(arena.take<Sibling>(12));
  });
  table.build(*strip, 0.15 * diameter_m);
  find_siblings(*strip, table, Vec3d(0.0, 0.0, 0.01), diameter_m, Symmetry::None, siblings);
  std::array<bool, 2> found{};
  for (const Sibling& sibling : siblings) {
    // Within 3 degrees, and half a spacing of the points.
    if (sibling.motion.linear().trace() < 2.997) continue;
    const Vec3d shift = sibling.motion.translation();
    for (const std::size_t side : {0U, 1U}) {
      const double wanted = side == 0 ? kPitch_m : -kPitch_m;
      found[side] = found[side] || (shift - Vec3d(wanted, 0.0, 0.0)).norm() < 0.002;
    }
  }
  EXPECT_TRUE(found[0]);
  EXPECT_TRUE(found[1]);
}

TEST(SelfSimilarity, ACubeHasItsTwentyThreeTurnsAsFarAsTheyFit) {
  const Part cube({0.2, 0.2, 0.2}, 0.0, Symmetry::None);
  EXPECT_EQ(cube.siblings().size(), 12U);
  for (const Sibling& sibling : cube.siblings()) {
    EXPECT_GT(sibling.share, 0.95);
    // Every entry of a cube's turn is 0, 1 or -1.
    for (const double entry : sibling.motion.linear().reshaped()) {
      EXPECT_NEAR(entry, std::round(entry), 0.02);
    }
  }
}

TEST(MirroredSiblings, ABoxHasNoneAsItIsItsOwnMirrorImage) {
  for (const Symmetry symmetry : {Symmetry::None, Symmetry::Z180, Symmetry::Box}) {
    EXPECT_TRUE(Part({0.4, 0.3, 0.2}, 0.0, symmetry).mirrored().empty());
  }
}

TEST(MirroredSiblings, APartWithOnePlaneOfSymmetryHasNone) {
  // The block lies half way to the middle of one edge: y -> -y maps the part onto itself.
  EXPECT_TRUE(Part({0.4, 0.3, 0.2}, 0.03, Symmetry::None, false).mirrored().empty());
}

TEST(MirroredSiblings, ABlockNearOneCornerIsToldFromEachOfItsReflections) {
  const Part part({0.4, 0.3, 0.2}, 0.03, Symmetry::None);
  // The three reflections of a box along its axes, and the one in its centre.
  EXPECT_EQ(part.mirrored().size(), 4U);
  for (const Sibling& sibling : part.mirrored()) {
    EXPECT_NEAR(sibling.motion.linear().determinant(), -1.0, 1e-9);
  }
  // As of the half turns: the block and where it is carried to, 4 % of the surface and its edges.
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GT(part.reflection(axis), 0.90) << axis;
    EXPECT_LT(part.reflection(axis), 0.985) << axis;
  }
}

TEST(MirroredSiblings, ABlockThatReadingsHardlyShowMakesNone) {
  // A sheet of 3 mm on a part of half a metre: a reading's noise at one metre is 1.5 mm.
  EXPECT_TRUE(Part({0.4, 0.3, 0.2}, 0.003, Symmetry::None).mirrored().empty());
}

}  // namespace
}  // namespace grapnel
