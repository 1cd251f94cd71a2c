// The judge of frames: edges, the rendered model, its comparison with the measurement, the verdict.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "base/rng.h"
#include "pipeline/judge/covariance.h"
#include "pipeline/judge/rival_test.h"
#include "pipeline/judge/verdict.h"
#include "pipeline/judge/verification.h"
#include "tests/pipeline/support/box_scene.h"

namespace grapnel {
namespace {

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr double kFocal_px = 280.0;
constexpr double kBelt_m = 1.1;
const Vec3d kSize_m = {0.4, 0.3, 0.2};

/// A box on a belt, its labels, and a model of the same box.
/// The model's points one by one.
class ClosestByLoop final : public ClosestSurface {
 public:
  explicit ClosestByLoop(const Surface& model) : model_(model) {}
  [[nodiscard]] std::int32_t closest(const Vec3f& p, float max_distance_m) const noexcept override {
    std::int32_t best = -1;
    float least = max_distance_m * max_distance_m;
    for (std::size_t i = 0; i < model_.size; ++i) {
      const float square = (model_.point(i) - p).squaredNorm();
      if (square > least) continue;
      least = square;
      best = static_cast<std::int32_t>(i);
    }
    return best;
  }

 private:
  const Surface& model_;
};

class FrameJudge : public testing::Test {
 protected:
  FrameJudge()
      : scene_(kWidth, kHeight, kFocal_px, kBelt_m),
        truth_(test::lying(kSize_m, kBelt_m, 0.04, 0.02, 0.3)),
        model_(test::surface_of(test::box_cloud(kSize_m, 0.005))),
        flat_(model_->size, 1),
        memory_([&](Arena& arena) {
          edges_.reserve(arena, kWidth * kHeight);
          render_.reserve(arena, kWidth * kHeight, 4096);
          verification_.reserve(arena, kWidth * kHeight, model_->size);
          rivals_.reserve(arena, kWidth * kHeight, kWidth);
        }) {
    model_->spacing_m = 0.005;
    scene_.add(truth_, kSize_m);
  }

  void label() {
    const DepthFrame& frame = scene_.frame();
    label_.assign(kWidth * kHeight, 0);
    for (std::size_t i = 0; i < label_.size(); ++i) {
      const double z = scene_.pixels().counts[i] * frame.metres_per_unit;
      label_[i] = z > 0.0 && z < kBelt_m - 0.01 ? 1 : 0;
    }
    view_ = {};
    view_.intrinsics = frame.intrinsics;
    view_.depth = frame.depth;
    view_.metres_per_unit = static_cast<float>(frame.metres_per_unit);
    view_.label = {label_.data(), kWidth, kHeight};
    view_.object = 1;
    view_.box = {0, 0, kWidth, kHeight};
    edges_.build(view_);
  }

  Evidence verify(const Pose& pose) {
    label();
    render_.render(*model_, pose, view_);
    render_.find_contour(*model_, pose, view_);
    return verification_.verify(*model_, flat_, pose, render_, view_, edges_, 0.004);
  }

  void erase(int left, int top, int right, int bottom, double z_m) {
    for (int v = top; v < bottom; ++v) {
      for (int u = left; u < right; ++u) {
        scene_.pixels().at(u, v) =
            static_cast<std::uint16_t>(std::lround(z_m / scene_.frame().metres_per_unit));
      }
    }
  }

  /// The first pose against the second, each reading for itself.
  Contrast compare(const Pose& first, const Pose& second) {
    label();
    render_.render(*model_, first, view_);
    rivals_.keep(render_);
    render_.render(*model_, second, view_);
    return rivals_.against(render_, view_, 1.0);
  }

  test::BoxScene scene_;
  Pose truth_;
  test::OwnedSurface model_;
  std::vector<std::uint8_t> flat_;
  EdgeMap edges_;
  ModelRender render_;
  Verification verification_;
  RivalTest rivals_;
  test::ArenaMemory memory_;
  std::vector<std::uint8_t> label_;
  DepthView view_;
};

TEST_F(FrameJudge, RendersTheDepthThatRaysMeet) {
  label();
  render_.render(*model_, truth_, view_);
  std::size_t compared = 0;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      if (label_[static_cast<std::size_t>(v * kWidth + u)] == 0) continue;
      if (!(render_.z_m(u, v) > 0.0F)) continue;
      ++compared;
      // Half a count of quantisation on the faces; at the edges discs stand over by a radius.
      EXPECT_NEAR(render_.z_m(u, v), view_.z_m(u, v), 0.008F);
    }
  }
  EXPECT_GT(compared, 7000U);
}

TEST_F(FrameJudge, TheTruePoseIsMatchedWholly) {
  const Evidence evidence = verify(truth_);
  EXPECT_GT(evidence.matched, 0.99);
  EXPECT_LT(evidence.seen_through, 0.005);
  EXPECT_GT(evidence.edge, 0.95);
  EXPECT_GT(evidence.edge_known, 0.95);
  EXPECT_LT(evidence.unexplained, 0.05);
  EXPECT_GT(evidence.explained, 0.95);
  EXPECT_LT(evidence.rmse_m, 0.0005);
  // The top face, the rim of two pixels left out, and slivers of two sides.
  EXPECT_NEAR(evidence.matched_area_m2, 0.4 * 0.3, 0.02);
  EXPECT_NEAR(evidence.matched + evidence.seen_through + evidence.occluded + evidence.unknown, 1.0,
              1e-9);
}

TEST_F(FrameJudge, APoseTooNearIsSeenThrough) {
  Pose pose = truth_;
  pose.translation().z() -= 0.03;
  const Evidence evidence = verify(pose);
  EXPECT_LT(evidence.matched, 0.1);
  EXPECT_GT(evidence.seen_through, 0.9);
  EXPECT_GT(evidence.hole_area_m2, 0.09);
  EXPECT_LT(worth(evidence), 0.0);
}

TEST_F(FrameJudge, APoseTooFarIsOccluded) {
  Pose pose = truth_;
  pose.translation().z() += 0.03;
  const Evidence evidence = verify(pose);
  EXPECT_LT(evidence.matched, 0.1);
  EXPECT_GT(evidence.occluded, 0.8);
  EXPECT_GT(evidence.unexplained, 0.5);
}

TEST_F(FrameJudge, APoseSlidAlongTheTopMissesTheOutline) {
  Pose pose = truth_;
  pose.translation() += truth_.linear() * Vec3d(0.04, 0.0, 0.0);
  const Evidence evidence = verify(pose);
  EXPECT_LT(evidence.edge, 0.7);
  EXPECT_GT(evidence.seen_through, 0.03);
  EXPECT_LT(worth(evidence), worth(verify(truth_)) - 0.3);
}

TEST_F(FrameJudge, AHoleIsFoundAsOnePiece) {
  // 20 × 20 px at 0.9 m and 280 px: 0.064 m a side.
  erase(160, 110, 180, 130, kBelt_m);
  const Evidence evidence = verify(truth_);
  EXPECT_NEAR(evidence.hole_area_m2, 0.0643 * 0.0643, 0.0005);
  EXPECT_GT(evidence.seen_through, 0.03);
}

TEST_F(FrameJudge, MixedPixelsAlongAnEdgeAreNoPieceAndAStripIs) {
  const Evidence clean = verify(truth_);
  EXPECT_EQ(clean.stray_area_m2, 0.0);
  const PixelBox seen = render_.marked();
  const int v = (seen.v0 + seen.v1) / 2;
  int u = seen.u0;
  while (!(render_.z_m(u, v) > 0.0F)) ++u;
  erase(u, v, u + 1, v + 10, kBelt_m - 0.1);
  EXPECT_EQ(verify(truth_).stray_area_m2, 0.0);
}

TEST_F(FrameJudge, SomethingThatLiesOnThePartIsAPieceAndAnotherThingBeforeItIsNot) {
  erase(150, 105, 170, 125, kBelt_m - 0.23);
  const double pixel_m = (kBelt_m - 0.2) / kFocal_px;
  EXPECT_NEAR(verify(truth_).stray_area_m2, 400 * pixel_m * pixel_m, 2 * pixel_m * pixel_m);
  // As a label of its own, first a fragment, then large enough for a thing.
  const auto again = [&](std::uint32_t things) {
    label();
    for (int v = 105; v < 125; ++v) {
      for (int u = 150; u < 170; ++u) label_[static_cast<std::size_t>(v * kWidth + u)] = 2;
    }
    view_.things = things;
    return verification_.verify(*model_, flat_, truth_, render_, view_, edges_, 0.004)
        .stray_area_m2;
  };
  EXPECT_NEAR(again(1), 400 * pixel_m * pixel_m, 2 * pixel_m * pixel_m);
  EXPECT_EQ(again(3), 0.0);
}

TEST_F(FrameJudge, WhatOfTheObjectLiesBesideAPoseIsLeftOver) {
  verify(truth_);
  const auto left_over_m2 = [&] {
    const ClosestByLoop closest(*model_);
    return verification_.left_over_m2(
        LeftOver(closest, disc_radius_m(*model_), truth_, render_, view_, 0.06F), render_, view_);
  };
  EXPECT_EQ(left_over_m2(), 0.0);
  // A block of 9 px a side against the part, a little lower than its top.
  const PixelBox seen = render_.marked();
  const int v = (seen.v0 + seen.v1) / 2;
  int u = seen.u1 - 1;
  while (!(render_.z_m(u, v) > 0.0F)) --u;
  erase(u + 1, v, u + 10, v + 9, kBelt_m - 0.15);
  verify(truth_);
  const double pixel_m = (kBelt_m - 0.15) / kFocal_px;
  // Two columns beside the outline may be mixed ones, and the nearest of the rest is the wall's.
  EXPECT_NEAR(left_over_m2(), 7 * 9 * pixel_m * pixel_m, 20 * pixel_m * pixel_m);
  // Cut off by segmentation and too small for a part of its own: still left over.
  const auto relabel = [&](std::uint8_t label) {
    for (int row = v; row < v + 9; ++row) {
      for (int column = u + 1; column < u + 10; ++column) {
        label_[static_cast<std::size_t>(row * kWidth + column)] = label;
      }
    }
  };
  relabel(2);
  view_.things = 1;
  EXPECT_GT(left_over_m2(), 40 * pixel_m * pixel_m);
  // Large enough for another thing: none of this part's business.
  view_.things = 3;
  EXPECT_EQ(left_over_m2(), 0.0);
}

TEST_F(FrameJudge, SomethingNearerOccludesAndMissingReadingsAreUnknown) {
  erase(150, 100, 170, 140, 0.5);
  erase(175, 100, 185, 140, 0.0);
  const Evidence evidence = verify(truth_);
  EXPECT_NEAR(evidence.occluded, 800.0 / evidence.pixels, 0.02);
  EXPECT_NEAR(evidence.unknown, 400.0 / evidence.pixels, 0.02);
  EXPECT_LT(evidence.seen_through, 0.01);
}

TEST_F(FrameJudge, ThinningKeepsPixelsOnTheirRays) {
  label();
  ThinnedDepth thinned;
  const test::ArenaMemory memory([&](Arena& arena) { thinned.reserve(arena, kWidth * kHeight); });
  DepthView view = view_;
  view.box = {41, 33, 300, 200};
  thinned.thin(view, 3);
  EXPECT_EQ(view.depth.width, 86);
  for (int v = 0; v < view.depth.height; ++v) {
    for (int u = 0; u < view.depth.width; ++u) {
      const double z = static_cast<double>(view.z_m(u, v));
      const double x = (u - view.intrinsics.cx) / view.intrinsics.fx * z;
      const double y = (v - view.intrinsics.cy) / view.intrinsics.fy * z;
      const int full_u =
          static_cast<int>(std::lround(x / z * view_.intrinsics.fx + view_.intrinsics.cx));
      const int full_v =
          static_cast<int>(std::lround(y / z * view_.intrinsics.fy + view_.intrinsics.cy));
      ASSERT_EQ(view_.z_m(full_u, full_v), view.z_m(u, v));
    }
  }
}

TEST_F(FrameJudge, TheNearestEdgeIsTheNearestOfAll) {
  erase(60, 60, 90, 80, 0.8);
  label();
  std::vector<std::pair<int, int>> all;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      if (edges_.nearest(u, v, 0.0).found) all.emplace_back(u, v);
    }
  }
  ASSERT_GT(all.size(), 300U);
  for (int v = 0; v < kHeight; v += 7) {
    for (int u = 0; u < kWidth; u += 7) {
      int best = 1 << 30;
      for (const auto& [eu, ev] : all) {
        best = std::min(best, (eu - u) * (eu - u) + (ev - v) * (ev - v));
      }
      for (const double reach : {1.5, 7.0, 64.0, 1000.0}) {
        const EdgeMap::Nearest nearest = edges_.nearest(u, v, reach);
        ASSERT_EQ(nearest.found, best <= reach * reach) << u << ' ' << v << " within " << reach;
        if (!nearest.found) continue;
        EXPECT_EQ(nearest.square, best);
        EXPECT_TRUE(edges_.nearest(nearest.u, nearest.v, 0.0).found);
        EXPECT_EQ((nearest.u - u) * (nearest.u - u) + (nearest.v - v) * (nearest.v - v), best);
      }
    }
  }
}

TEST_F(FrameJudge, ReadingsThatEndInNothingAreNoEdge) {
  // All around the box nothing is read, farther than a projector's shadow reaches.
  for (std::uint16_t& count : scene_.pixels().counts) {
    if (count * scene_.frame().metres_per_unit > kBelt_m - 0.01) count = 0;
  }
  const Evidence evidence = verify(truth_);
  EXPECT_LT(evidence.edge_known, 0.05);
  EXPECT_GT(evidence.matched, 0.99);
}

TEST_F(FrameJudge, ATurnedBoxThatLooksTheSameIsNotToldApart) {
  Pose turned = truth_;
  turned.linear() = truth_.linear() * Eigen::Vector3d(-1.0, -1.0, 1.0).asDiagonal();
  EXPECT_LT(compare(truth_, turned).certainty(), 0.01);
  EXPECT_LT(compare(turned, truth_).certainty(), 0.01);
  EXPECT_TRUE(compare(truth_, turned).alike());
  EXPECT_TRUE(compare(turned, truth_).alike());
}

TEST_F(FrameJudge, ATurnedBoxThatLooksDifferentIsToldApartWhicheverComesFirst) {
  Pose turned = truth_;
  turned.linear().col(0) = truth_.linear().col(1);
  turned.linear().col(1) = -truth_.linear().col(0);
  const Contrast right = compare(truth_, turned);
  EXPECT_GT(right.share, 0.95);
  EXPECT_GT(right.certainty(), 0.9);
  EXPECT_TRUE(right.beyond_doubt());
  EXPECT_FALSE(right.alike());
  const Contrast wrong = compare(turned, truth_);
  EXPECT_NEAR(wrong.gain, -right.gain, 1e-9 * right.gain);
  EXPECT_EQ(wrong.certainty(), 0.0);
  EXPECT_FALSE(wrong.beyond_doubt());
  EXPECT_FALSE(wrong.alike());
}

TEST_F(FrameJudge, WhatHidesOneOfTwoPosesSaysNothingAgainstIt) {
  // The second pose lies 8 cm farther right; what it alone predicts, the belt's readings refute.
  Pose beside = truth_;
  beside.translation().x() += 0.08;
  const Contrast open = compare(truth_, beside);
  EXPECT_GT(open.gain, 0.0);
  // Something else, of another label, hides the right half of the image, nearer than any top.
  const int from = kWidth / 2 + 30;
  erase(from, 0, kWidth, kHeight, 0.6);
  label();
  for (int v = 0; v < kHeight; ++v) {
    for (int u = from; u < kWidth; ++u) label_[static_cast<std::size_t>(v * kWidth + u)] = 2;
  }
  render_.render(*model_, truth_, view_);
  rivals_.keep(render_);
  std::vector<bool> first(label_.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    first[i] = render_.z_m(static_cast<int>(i) % kWidth, static_cast<int>(i) / kWidth) > 0.0F;
  }
  render_.render(*model_, beside, view_);
  double hidden = 0.0;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = from; u < kWidth; ++u) {
      const bool alone = !first[static_cast<std::size_t>(v * kWidth + u)];
      hidden += alone && render_.z_m(u, v) > 0.0F ? 1.0 : 0.0;
    }
  }
  const Contrast covered = rivals_.against(render_, view_, 1.0);
  EXPECT_GT(hidden, 500.0);
  // Each was worth 9 while the belt was seen there; along the edges, a quarter of them, nothing.
  EXPECT_LT(covered.gain, open.gain - 0.75 * 9.0 * hidden);
  EXPECT_GT(covered.gain, 0.0);
}

TEST_F(FrameJudge, WhereNothingIsReadNothingIsTold) {
  erase(0, 0, kWidth, kHeight, 0.0);
  Pose turned = truth_;
  turned.linear().col(0) = truth_.linear().col(1);
  turned.linear().col(1) = -truth_.linear().col(0);
  EXPECT_EQ(compare(truth_, turned).certainty(), 0.0);
  EXPECT_TRUE(compare(truth_, turned).alike());
}

TEST(Contrast, IsBeyondDoubtOnlyWhereMostOfManyReadingsAgree) {
  EXPECT_TRUE((Contrast{300.0, 0.9}.beyond_doubt()));
  EXPECT_FALSE((Contrast{299.0, 0.9}.beyond_doubt()));
  EXPECT_FALSE((Contrast{300.0, 0.89}.beyond_doubt()));
  EXPECT_NEAR((Contrast{300.0, 0.9}.certainty()), 0.8, 1e-12);
}

Findings good_findings() {
  Findings findings;
  findings.evidence.matched = 0.98;
  findings.evidence.matched_area_m2 = 0.1;
  findings.evidence.edge = 0.95;
  findings.evidence.edge_known = 1.0;
  findings.evidence.explained = 1.0;
  findings.evidence.rmse_m = 0.001;
  findings.evidence.second_face = 0.3;
  findings.margin = 0.8;
  findings.has_mirror = true;
  findings.mirror_margin = 0.8;
  findings.sigma_m = 0.0005;
  findings.sigma_rad = 0.002;
  findings.diameter_m = 0.5;
  findings.tolerance_m = 0.004;
  return findings;
}

TEST(Verdict, AcceptsOnlyWhenEveryCheckPasses) {
  RegistrationReport report;
  pass_verdict(good_findings(), {}, report);
  EXPECT_TRUE(report.accepted);
  EXPECT_EQ(report.code, Code::ObjectFound);
  EXPECT_TRUE(report.reasons.empty());
  EXPECT_GT(report.quality, 0.5);
}

TEST(Verdict, NamesEveryFailingCheckWithItsFigures) {
  struct Case {
    void (*spoil)(Findings&);
    Check check;
    Code code;
  };
  const Case cases[] = {
      {[](Findings& f) { f.evidence.matched = 0.5; }, Check::MatchedShare, Code::BelowFitness},
      {[](Findings& f) { f.evidence.matched_area_m2 = 1e-4; }, Check::MatchedArea,
       Code::TooFewPoints},
      {[](Findings& f) { f.evidence.seen_through = 0.1; }, Check::SeenThrough,
       Code::FreeSpaceViolated},
      {[](Findings& f) { f.evidence.hole_area_m2 = 0.01; }, Check::Hole, Code::FreeSpaceViolated},
      {[](Findings& f) { f.evidence.rmse_m = 0.0039; }, Check::Deviation, Code::RefinementDiverged},
      {[](Findings& f) { f.evidence.unknown = 0.4; }, Check::Unknown, Code::TooMuchUnknown},
      {[](Findings& f) { f.outside = 0.4; }, Check::Outside, Code::TooMuchUnknown},
      {[](Findings& f) { f.evidence.unexplained = 0.5; }, Check::Unexplained,
       Code::UnexplainedForeground},
      {[](Findings& f) { f.evidence.edge = 0.3; }, Check::Outline, Code::ContourDisagrees},
      {[](Findings& f) { f.margin = 0.02; }, Check::Margin, Code::Ambiguous},
      {[](Findings& f) { f.mirror_margin = 0.02; }, Check::Mirror, Code::Ambiguous},
      {[](Findings& f) { f.sigma_m = 0.01; }, Check::Shift, Code::NotObservable},
      {[](Findings& f) { f.sigma_rad = 0.1; }, Check::Turn, Code::NotObservable},
  };
  for (const Case& c : cases) {
    Findings findings = good_findings();
    c.spoil(findings);
    RegistrationReport report;
    pass_verdict(findings, {}, report);
    EXPECT_FALSE(report.accepted);
    ASSERT_EQ(report.reasons.size(), 1U) << static_cast<int>(c.code);
    EXPECT_EQ(report.reasons[0].check, c.check);
    EXPECT_EQ(report.reasons[0].code(), c.code);
    EXPECT_EQ(report.code, c.code);
    EXPECT_LT(report.quality, 0.5);
  }
}

TEST(Verdict, OneFlatFaceIsBelievedOnlyWithItsOutlineProven) {
  Findings findings = good_findings();
  findings.evidence.second_face = 0.01;
  RegistrationReport report;
  pass_verdict(findings, {}, report);
  EXPECT_TRUE(report.accepted);
  // A table top with the face's edge along half of the outline.
  findings.evidence.edge_known = 0.5;
  pass_verdict(findings, {}, report);
  ASSERT_EQ(report.reasons.size(), 1U);
  EXPECT_EQ(report.reasons[0].check, Check::FlatProof);
  EXPECT_DOUBLE_EQ(report.reasons[0].measured, 0.98 * 0.5 * 0.95);
  // The same outline around a shape that shows two faces is no objection.
  findings.evidence.second_face = 0.3;
  pass_verdict(findings, {}, report);
  EXPECT_TRUE(report.accepted);
}

TEST(Verdict, AcceptsNoPoseOfLessThanTheLeastWorth) {
  Rng rng(5);
  const VerdictParams params;
  const double least = least_accepted_worth(params);
  double smallest = 1.0;
  for (int i = 0; i < 20000; ++i) {
    Findings findings = good_findings();
    Evidence& evidence = findings.evidence;
    evidence.pixels = 5000;
    evidence.unknown = rng.uniform(0.0, 0.3);
    evidence.seen_through = rng.uniform(0.0, 0.04);
    evidence.matched = (1.0 - evidence.unknown) * rng.uniform(0.68, 0.8);
    evidence.unexplained = rng.uniform(0.0, 0.2);
    evidence.edge = rng.uniform(0.5, 1.0);
    evidence.edge_known = rng.uniform(0.0, 1.0);
    RegistrationReport report;
    pass_verdict(findings, params, report);
    if (!report.accepted) continue;
    EXPECT_GE(worth(evidence), least);
    smallest = std::min(smallest, worth(evidence));
  }
  // Every limit just met: 0.70 · 0.75 matched, 0.03 seen through, 0.15 left over, 0.60 of an edge.
  EXPECT_NEAR(least, 0.525 - 0.06 - 0.075 - 0.2, 1e-6);
  EXPECT_LT(smallest, least + 0.1);
}

TEST(Verdict, WithoutAKnownBeltNoPartIsBelievedToLieOnIt) {
  VerdictParams params;
  params.max_belt_distance_m = 0.015;
  RegistrationReport report;
  pass_verdict(good_findings(), params, report);
  ASSERT_EQ(report.reasons.size(), 1U);
  EXPECT_EQ(report.reasons[0].check, Check::BeltKnown);
}

TEST(Verdict, APartOnTheBeltMustTouchItAndStand) {
  Findings findings = good_findings();
  findings.has_belt = true;
  findings.resting = {0.002, 0.2, 0.08};
  VerdictParams params;
  params.max_belt_distance_m = 0.015;
  RegistrationReport report;
  pass_verdict(findings, params, report);
  EXPECT_TRUE(report.accepted);
  findings.resting = {0.02, 0.22, -0.05};
  pass_verdict(findings, params, report);
  ASSERT_EQ(report.reasons.size(), 2U);
  EXPECT_EQ(report.reasons[0].check, Check::BeltDistance);
  EXPECT_EQ(report.reasons[1].check, Check::Support);
  EXPECT_EQ(report.code, Code::ImplausibleOnBelt);
}

TEST(Verdict, WithTheBeltAroundItNoPartReachesIntoTheBelt) {
  Findings findings = good_findings();
  findings.has_belt = true;
  findings.resting = {-0.15, 0.05, 0.08};
  findings.evidence.beside_belt = 0.9;
  RegistrationReport report;
  pass_verdict(findings, {}, report);
  ASSERT_EQ(report.reasons.size(), 1U);
  EXPECT_EQ(report.reasons[0].check, Check::Sunk);
  EXPECT_EQ(report.code, Code::ImplausibleOnBelt);
  // At a table's end it may hang below the top.
  findings.evidence.beside_belt = 0.3;
  pass_verdict(findings, {}, report);
  EXPECT_TRUE(report.accepted);
}

TEST(Verdict, APartMustEndOnTheGroundThatIsSeenBesideIt) {
  Findings on_belt = good_findings();
  on_belt.has_belt = true;
  on_belt.closed = true;
  on_belt.resting = {0.002, 0.2, 0.08};
  on_belt.ground = {0.0, 0.9, 0.0};
  on_belt.ground_tolerance_m = 0.005;
  RegistrationReport report;
  pass_verdict(on_belt, {}, report);
  EXPECT_TRUE(report.accepted);
  const auto rejected_for_ground = [&](const Findings& findings) {
    pass_verdict(findings, {}, report);
    return report.reasons.size() == 1 && report.reasons[0].check == Check::Ground &&
           report.code == Code::ImplausibleOnBelt;
  };
  Findings top_of_higher = on_belt;
  top_of_higher.resting = {0.02, 0.22, 0.08};
  EXPECT_TRUE(rejected_for_ground(top_of_higher));
  Findings lower_on_plate = on_belt;
  lower_on_plate.ground.level_m = 0.013;
  EXPECT_TRUE(rejected_for_ground(lower_on_plate));
  // What it stands on or hangs from is seen, the ground is not, or the model has no underside.
  Findings borne = top_of_higher;
  borne.ground.borne = 0.2;
  EXPECT_FALSE(rejected_for_ground(borne));
  Findings in_heap = top_of_higher;
  in_heap.ground.share = 0.3;
  EXPECT_FALSE(rejected_for_ground(in_heap));
  // Of one flat face nothing but the ground tells the height.
  const auto rejected_for_height = [&](Findings findings) {
    findings.evidence.second_face = 0.01;
    pass_verdict(findings, {}, report);
    return report.reasons.size() == 1 && report.reasons[0].check == Check::Height &&
           report.code == Code::ImplausibleOnBelt;
  };
  EXPECT_TRUE(rejected_for_height(in_heap));
  EXPECT_FALSE(rejected_for_height(on_belt));
  Findings scan = top_of_higher;
  scan.closed = false;
  EXPECT_FALSE(rejected_for_ground(scan));
  // Between others as high as itself it does not lie in them.
  Findings between = on_belt;
  between.ground.level_m = 0.19;
  EXPECT_FALSE(rejected_for_ground(between));
}

TEST(Verdict, APieceLeftOverIsLimitedWhereThePresetAsks) {
  Findings findings = good_findings();
  findings.left_over_m2 = 0.002 * findings.diameter_m * findings.diameter_m;
  RegistrationReport report;
  pass_verdict(findings, {}, report);
  EXPECT_TRUE(report.accepted);
  VerdictParams params;
  params.max_left_over = 0.001;
  pass_verdict(findings, params, report);
  ASSERT_EQ(report.reasons.size(), 1U);
  EXPECT_EQ(report.reasons[0].check, Check::LeftOver);
}

TEST(Verdict, NoEvidenceIsARejectionAndNaNPassesNoCheck) {
  RegistrationReport report;
  pass_verdict({}, {}, report);
  EXPECT_FALSE(report.accepted);
  Findings findings = good_findings();
  findings.sigma_m = std::nan("");
  pass_verdict(findings, {}, report);
  EXPECT_FALSE(report.accepted);
}

TEST(Verdict, ReasonsReadAsSentences) {
  char text[160];
  const std::size_t size = reason_text({Check::MatchedShare, 0.414, 0.7}, text, sizeof text);
  EXPECT_STREQ(text, "matched share of the visible model 0.41, at least 0.70 is required");
  EXPECT_EQ(size, std::strlen(text));
  EXPECT_EQ(reason_text({Check::MatchedShare, 0.414, 0.7}, text, 8), 7U);
  EXPECT_STREQ(text, "matched");
  reason_text({Check::Turn, 0.05235987755982988, 0.017453292519943295}, text, sizeof text);
  EXPECT_STREQ(text,
               "predicted deviation about the weakest required axis 3.00 degrees, at most 1.00 "
               "degrees is allowed");
  reason_text({Check::Support, -0.0123, 0.0}, text, sizeof text);
  EXPECT_STREQ(
      text,
      "distance of the part's centre inside what it stands on -12.3 mm, at least 0.0 mm is "
      "required");
}

TEST(Covariance, OfAPlaneIsLargeAlongIt) {
  Mat6d information = Mat6d::Identity() * 1e2;
  information(2, 2) = 1e6;
  const Mat6d covariance = pose_covariance(information, {0.001, 10.0, 0.0, 0.0});
  EXPECT_NEAR(covariance(2, 2), 1e-6 * 10.0 / 1e6, 1e-13);
  RequiredDirections only_z;
  for (bool& direction : only_z.direction) direction = false;
  only_z.direction[2] = true;
  EXPECT_NEAR(uncertainty_at(covariance, Pose::Identity(), only_z).sigma_m, std::sqrt(1e-11), 1e-8);
  const Uncertainty all = uncertainty_at(covariance, Pose::Identity(), {});
  EXPECT_NEAR(all.sigma_m, std::sqrt(1e-7), 1e-6);
}

TEST(Covariance, KeepsWhatNoNumberOfReadingsAveragesOut) {
  const Mat6d covariance = pose_covariance(Mat6d::Identity() * 1e12, {0.001, 1.0, 0.003, 0.002});
  EXPECT_NEAR(covariance(0, 0), 9e-6, 1e-15);
  EXPECT_NEAR(covariance(1, 1), 9e-6, 1e-15);
  EXPECT_NEAR(covariance(2, 2), 4e-6, 1e-15);
  EXPECT_NEAR(covariance(3, 3), 0.0, 1e-15);
}

TEST(Covariance, AnErrorThatOneSortOfReadingsSharesCountsByTheirWeight) {
  // Along x an outline of variance 1e-6 m² and a surface of a quarter of that: the outline's common
  // error of 2 mm shifts their mean by a fifth.
  PoseReadings readings;
  readings.information = Mat6d::Identity() * 1e9;
  readings.information(0, 0) = 1e6 + 4e6;
  readings.common(0, 0) = 1e6 * 1e-3;  // an error of 1 mm
  readings.misfit[1] = 1e9 * 1e-4;     // all readings say that it lies 0.1 mm further along y
  readings.rounding(3, 3) = 1e9 * 1e-4 * 1e9 * 1e-4;  // of one value, which turns it by 0.1 mrad
  const Mat6d covariance = pose_covariance(readings, {2.0, 5.0, 5.0});
  EXPECT_NEAR(covariance(0, 0), 1.0 / 5e6 + 0.4e-3 * 0.4e-3, 1e-12);
  EXPECT_NEAR(covariance(1, 1), 1e-9 + 1e-8, 1e-12);
  EXPECT_NEAR(covariance(2, 2), 1e-9, 1e-12);
  EXPECT_NEAR(covariance(3, 3), 1e-9 + 1e-8, 1e-12);
}

TEST(Covariance, OfAKnownTurnReachesNoOtherDirection) {
  // Known but for a turn about a line through (0.2, 0, 1) along z, which also shifts the origin.
  Vec6d turn;
  turn << 0.0, -0.2, 0.0, 0.0, 0.0, 1.0;
  const Mat6d all = Mat6d::Identity() * 1e6;
  Mat6d information = all - 1e6 * turn * turn.transpose() / turn.squaredNorm();
  EXPECT_GT(pose_covariance(information, {0.001, 1.0, 0.0, 0.0})(1, 1), 1e-6);
  take_turn_as_known(Vec3d(0.2, 0.0, 1.0), Vec3d::UnitZ(), information);
  EXPECT_LT(pose_covariance(information, {0.001, 1.0, 0.0, 0.0})(1, 1), 2e-12);
}

TEST(Covariance, AFreeAxisIsNotRequired) {
  const RequiredDirections required = required_directions({}, Symmetry::AxisZ);
  EXPECT_TRUE(required.direction[4]);
  EXPECT_FALSE(required.direction[5]);
  const RequiredDirections named = required_directions({"x", "rz"}, Symmetry::None);
  EXPECT_TRUE(named.direction[0]);
  EXPECT_FALSE(named.direction[1]);
  EXPECT_TRUE(named.direction[5]);
}

}  // namespace
}  // namespace grapnel
