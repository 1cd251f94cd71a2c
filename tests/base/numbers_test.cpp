// Rng, hash and geometry.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "base/hash.h"
#include "base/math.h"
#include "base/rng.h"

namespace grapnel {
namespace {

TEST(Rng, MixesAsSplitMix64Does) {
  // Vigna's splitmix64.c, seed 1234567, as published with it.
  constexpr std::array<std::uint64_t, 5> kPublished = {
      6457827717110365317ULL, 3203168211198807973ULL, 9817491932198370423ULL,
      4593380528125082431ULL, 16408922859458223821ULL};
  for (std::uint64_t n = 0; n < kPublished.size(); ++n) {
    EXPECT_EQ(Rng::mix(1234567ULL + 0x9e3779b97f4a7c15ULL * (n + 1)), kPublished[n]);
  }
}

TEST(Rng, IsAPureFunctionOfSeedAndPlace) {
  Rng a(42);
  Rng b(42);
  for (int i = 0; i < 100; ++i) ASSERT_EQ(a.next_u64(), b.next_u64());
  Rng other(43);
  EXPECT_NE(Rng(42).next_u64(), other.next_u64());
}

TEST(Rng, SplitsIntoStreamsThatDoNotRepeatEachOther) {
  const Rng parent(5);
  std::set<std::uint64_t> seen;
  for (std::uint64_t label = 0; label < 100; ++label) {
    Rng stream = parent.split(label);
    for (int i = 0; i < 100; ++i) seen.insert(stream.next_u64());
  }
  EXPECT_EQ(seen.size(), 10'000u);
}

TEST(Rng, HasTheMomentsOfItsDistributions) {
  constexpr int kCount = 200'000;
  Rng rng(11);
  double sum = 0.0;
  double normal_sum = 0.0;
  double normal_square = 0.0;
  double normal_fourth = 0.0;
  for (int i = 0; i < kCount; ++i) {
    const double uniform = rng.uniform();
    ASSERT_GE(uniform, 0.0);
    ASSERT_LT(uniform, 1.0);
    sum += uniform;
    const double normal = rng.normal();
    normal_sum += normal;
    normal_square += normal * normal;
    normal_fourth += normal * normal * normal * normal;
  }
  // Five standard errors: 0.29, 1, 1.41 and 9.8 over the root of the count.
  EXPECT_NEAR(sum / kCount, 0.5, 0.0033);
  EXPECT_NEAR(normal_sum / kCount, 0.0, 0.0112);
  EXPECT_NEAR(normal_square / kCount, 1.0, 0.0159);
  EXPECT_NEAR(normal_fourth / kCount, 3.0, 0.11);
}

TEST(Rng, DrawsBelowItsBoundEvenly) {
  Rng rng(13);
  std::array<int, 7> counts{};
  constexpr int kCount = 70'000;
  for (int i = 0; i < kCount; ++i) {
    const std::uint32_t drawn = rng.below(7);
    ASSERT_LT(drawn, 7u);
    ++counts[drawn];
  }
  // Six standard deviations of a binomial count: 6 · sqrt(10000 · 6/7).
  for (const int count : counts) EXPECT_NEAR(count, 10'000, 556);
}

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

TEST(Hash, TellsAnyTwoOfManyInputsApart) {
  std::set<std::uint64_t> seen;
  std::string text;
  for (int length = 0; length < 40; ++length) {
    seen.insert(hash_bytes(bytes_of(text)));
    std::string changed = text;
    for (std::size_t i = 0; i < text.size(); ++i) {
      changed[i] = static_cast<char>(changed[i] ^ 1);
      seen.insert(hash_bytes(bytes_of(changed)));
      changed[i] = text[i];
    }
    text += '\0';
  }
  EXPECT_EQ(seen.size(), 40u + 39u * 40u / 2u);
  EXPECT_NE(hash_bytes(bytes_of("a"), 1), hash_bytes(bytes_of("a"), 2));
}

TEST(Hash, FlipsHalfOfItsBitsForOneBitOfInput) {
  const std::string text(24, 'x');
  const std::uint64_t whole = hash_bytes(bytes_of(text));
  double flipped = 0.0;
  for (std::size_t bit = 0; bit < text.size() * 8; ++bit) {
    std::string changed = text;
    changed[bit / 8] = static_cast<char>(changed[bit / 8] ^ (1 << (bit % 8)));
    flipped += __builtin_popcountll(whole ^ hash_bytes(bytes_of(changed)));
  }
  // 192 words of 64 fair bits: standard error 0.29.
  EXPECT_NEAR(flipped / static_cast<double>(text.size() * 8), 32.0, 1.5);
}

TEST(Hash, FingerprintIsNeverZero) {
  for (int i = 0; i < 200'000; ++i) ASSERT_NE(fingerprint16(bytes_of(std::to_string(i))), 0);
}

TEST(Geometry, RotationAgreesWithEigensAngleAxis) {
  Rng rng(17);
  for (int i = 0; i < 2000; ++i) {
    const Vec3d axis = Vec3d(rng.normal(), rng.normal(), rng.normal()).normalized();
    const double angle_rad = i % 4 == 0 ? 1e-6 * rng.uniform() : rng.uniform(0.0, math::kPi);
    const Mat3d expected = Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix();
    const Mat3d rotation = rotation_from_vector(angle_rad * axis);
    ASSERT_LT((rotation - expected).cwiseAbs().maxCoeff(), 1e-13);
    ASSERT_LT((rotation * rotation.transpose() - Mat3d::Identity()).norm(), 1e-13);
    // Near half a turn the axis is known only to the root of the rounding error.
    const double tolerance = angle_rad > 3.1 ? 1e-6 : 1e-9;
    ASSERT_LT((vector_from_rotation(rotation) - angle_rad * axis).norm(), tolerance) << angle_rad;
  }
}

TEST(Geometry, HalfTurnsHaveTheirFirstAxisPartPositive) {
  for (const Vec3d& axis :
       {Vec3d(1, 0, 0), Vec3d(0, 1, 0), Vec3d(0, 0, 1), Vec3d(Vec3d(1, -2, 0.5).normalized())}) {
    const Mat3d half_turn = 2.0 * axis * axis.transpose() - Mat3d::Identity();
    EXPECT_LT((vector_from_rotation(half_turn) - math::kPi * axis).norm(), 1e-7);
  }
}

TEST(Geometry, AngleBetweenPosesIgnoresOrderAndFrame) {
  Rng rng(19);
  Pose a = Pose::Identity();
  Pose b = Pose::Identity();
  Pose frame = Pose::Identity();
  a.linear() = rotation_from_vector(Vec3d(0.3, -0.2, 0.9));
  b.linear() = a.linear() * rotation_from_vector(Vec3d(0.0, 0.7, 0.0));
  frame.linear() = rotation_from_vector(Vec3d(-1.0, 2.0, 0.1));
  a.translation() = Vec3d(5, 6, 7);
  EXPECT_NEAR(rotation_angle_rad(a, b), 0.7, 1e-12);
  EXPECT_NEAR(rotation_angle_rad(b, a), 0.7, 1e-12);
  EXPECT_NEAR(rotation_angle_rad(frame * a, frame * b), 0.7, 1e-12);
  EXPECT_NEAR(rotation_angle_rad(a, a), 0.0, 1e-12);
}

TEST(Geometry, TellsRigidMotionsFromOtherMatrices) {
  Mat4d rigid = Mat4d::Identity();
  rigid.topLeftCorner<3, 3>() = rotation_from_vector(Vec3d(0.1, 0.2, 0.3));
  rigid(0, 3) = 9.0;
  EXPECT_TRUE(is_rigid(rigid, 1e-9));
  Mat4d scaled = rigid;
  scaled.topLeftCorner<3, 3>() *= 1.01;
  EXPECT_FALSE(is_rigid(scaled, 1e-3));
  Mat4d mirrored = Mat4d::Identity();
  mirrored(2, 2) = -1.0;
  EXPECT_FALSE(is_rigid(mirrored, 1e-3));
  Mat4d projective = rigid;
  projective(3, 0) = 0.1;
  EXPECT_FALSE(is_rigid(projective, 1e-3));
  Mat4d lost = rigid;
  lost(1, 1) = std::nan("");
  EXPECT_FALSE(is_rigid(lost, 1e-3));
}

}  // namespace
}  // namespace grapnel
