#include "pipeline/judge/overlap.h"

#include <gtest/gtest.h>

#include "tests/pipeline/support/surfaces.h"

namespace grapnel {
namespace {

using test::ArenaMemory;
using test::OwnedSurface;

constexpr double kFocal_px = 100.0;
constexpr int kWidth = 80;
constexpr int kHeight = 60;

/// A plane facing the camera at depth `z_m`, one point a pixel, with its table.
class FlatView {
 public:
  explicit FlatView(float z_m)
      : surface_(kWidth * kHeight, kWidth * kHeight),
        memory_([&](Arena& arena) { table_.reserve(arena, 200000); }) {
    Surface& s = *surface_;
    s.grid.width = kWidth;
    s.grid.height = kHeight;
    s.grid.intrinsics = {kWidth, kHeight, kFocal_px, kFocal_px, 39.5, 29.5};
    s.has_viewpoint = true;
    s.size = kWidth * kHeight;
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const auto i = static_cast<std::size_t>(v * kWidth + u);
        s.x[i] = static_cast<float>((u - 39.5) / kFocal_px) * z_m;
        s.y[i] = static_cast<float>((v - 29.5) / kFocal_px) * z_m;
        s.z[i] = z_m;
        s.nz[i] = -1.0F;
        s.grid.point_of[i] = static_cast<std::int32_t>(i);
        s.grid.pixel_of[i] = static_cast<std::int32_t>(i);
      }
    }
    s.spacing_m = static_cast<double>(z_m) / kFocal_px;
    table_.build(s, 0.05);
  }

  [[nodiscard]] OverlapView view() { return {&*surface_, &*surface_, &table_, {}}; }
  Surface& surface() { return *surface_; }

 private:
  OwnedSurface surface_;
  ClosestPointTable table_;
  ArenaMemory memory_;
};

Pose shifted(double x_m, double z_m) {
  Pose pose = Pose::Identity();
  pose.translation() = Vec3d(x_m, 0.0, z_m);
  return pose;
}

TEST(Overlap, OfAViewWithItselfIsWhole) {
  FlatView view(1.0F);
  const OverlapEvidence found = test_overlap(view.view(), view.view(), Pose::Identity(), {});
  EXPECT_DOUBLE_EQ(found.matched_share(), 1.0);
  EXPECT_DOUBLE_EQ(found.seen_through_share(), 0.0);
  // All but the two pixels of rim on each side.
  EXPECT_DOUBLE_EQ(found.matched, (kWidth - 4) * (kHeight - 4));
}

TEST(Overlap, CountsASurfaceInFreeSpaceAsSeenThrough) {
  FlatView view(1.0F);
  // 50 mm nearer than what the camera measured; 3 sigma of two readings at 1 m are 6 mm.
  const OverlapEvidence found = test_overlap(view.view(), view.view(), shifted(0.0, -0.05), {});
  EXPECT_DOUBLE_EQ(found.matched, 0.0);
  EXPECT_DOUBLE_EQ(found.seen_through_share(), 1.0);
}

TEST(Overlap, SaysNothingOfWhatLiesBehindTheMeasuredSurface) {
  FlatView view(1.0F);
  const OverlapEvidence found = test_overlap(view.view(), view.view(), shifted(0.0, 0.05), {});
  EXPECT_DOUBLE_EQ(found.matched, 0.0);
  EXPECT_DOUBLE_EQ(found.seen_through, 0.0);
  EXPECT_GT(found.hidden, 0.0);
}

TEST(Overlap, LeavesOutWhatFallsBesideTheOtherPicture) {
  FlatView view(1.0F);
  // Half the picture's width at 1 m.
  const OverlapEvidence found = test_overlap(view.view(), view.view(), shifted(0.4, 0.0), {});
  EXPECT_DOUBLE_EQ(found.matched_share(), 1.0);
  EXPECT_NEAR(found.overlap(), 0.5 - 2.0 / kWidth - 4.0 / kHeight / 2.0, 0.02);
}

TEST(Overlap, DoesNotMatchSurfacesThatFaceElsewhere) {
  FlatView view(1.0F);
  FlatView turned(1.0F);
  Surface& surface = turned.surface();
  for (std::size_t i = 0; i < surface.size; ++i) {
    // 60 degrees from the other's normal, still toward the camera.
    surface.nx[i] = 0.866F;
    surface.nz[i] = -0.5F;
  }
  const OverlapEvidence found = test_overlap(turned.view(), view.view(), Pose::Identity(), {});
  EXPECT_DOUBLE_EQ(found.matched, 0.0);
  EXPECT_GT(found.misaligned, 0.0);
}

TEST(Overlap, WithoutACameraSeesNoFreeSpace) {
  FlatView view(1.0F);
  view.surface().has_viewpoint = false;
  const OverlapEvidence found = test_overlap(view.view(), view.view(), shifted(0.0, -0.03), {});
  EXPECT_DOUBLE_EQ(found.seen_through, 0.0);
  EXPECT_DOUBLE_EQ(found.matched, 0.0);
  EXPECT_GT(found.misaligned, 0.0);
}

OverlapFindings good() {
  OverlapFindings findings;
  findings.forward = {1000.0, 500.0, 5.0, 5.0, 100.0, 100.0, 500.0 * 1e-6, 0.9};
  findings.back = findings.forward;
  findings.margin = 1.0;
  findings.sigma_m = 1e-4;
  findings.sigma_rad = 1e-3;
  findings.size_m = 0.15;
  findings.spacing_m = 0.002;
  findings.tolerance_m = 0.004;
  return findings;
}

TEST(OverlapVerdict, AcceptsWhatPassesEveryCheck) {
  RegistrationReport report;
  pass_overlap_verdict(good(), {}, report);
  EXPECT_TRUE(report.accepted);
  EXPECT_EQ(report.code, Code::ObjectFound);
  EXPECT_NEAR(report.rmse_m, 0.001, 1e-12);
}

TEST(OverlapVerdict, LetsTheWorseDirectionDecide) {
  OverlapFindings findings = good();
  findings.back.seen_through = 200.0;
  RegistrationReport report;
  pass_overlap_verdict(findings, {}, report);
  EXPECT_FALSE(report.accepted);
  EXPECT_NEAR(report.free_space_violation, 200.0 / 705.0, 1e-12);
  EXPECT_NEAR(report.fitness, 500.0 / 705.0, 1e-12);
}

// A floor fits under a turned box, too: nearly all matches, but hardly what would notice the turn.
TEST(OverlapVerdict, RejectsWhereLittleConfirmsSomeMotion) {
  OverlapFindings findings = good();
  findings.back.least_share = 0.4;
  RegistrationReport report;
  pass_overlap_verdict(findings, {}, report);
  EXPECT_FALSE(report.accepted);
  EXPECT_EQ(report.reasons[0].check, Check::LeastShare);
}

// A view of floor alone slides over it: what matches holds the pose only loosely.
TEST(OverlapVerdict, RejectsAPoseThatItsReadingsHoldLoosely) {
  OverlapFindings findings = good();
  findings.size_m = 3.0;  // a fiftieth of it is 60 mm
  findings.spacing_m = 0.04;
  findings.sigma_m = 0.005;
  RegistrationReport report;
  pass_overlap_verdict(findings, {}, report);
  EXPECT_FALSE(report.accepted);
  ASSERT_EQ(report.reasons.size(), 1U);
  EXPECT_EQ(report.reasons[0].check, Check::Shift);
  OverlapParams by_size;
  by_size.max_sigma_m = 0.0;
  RegistrationReport other;
  pass_overlap_verdict(findings, by_size, other);
  EXPECT_TRUE(other.accepted);
}

TEST(OverlapVerdict, NamesEveryFailingCheck) {
  RegistrationReport report;
  pass_overlap_verdict({}, {}, report);
  EXPECT_FALSE(report.accepted);
  ASSERT_FALSE(report.reasons.empty());
  EXPECT_EQ(report.code, report.reasons[0].code());
  bool ambiguous = false;
  for (const Reason& reason : report.reasons) ambiguous |= reason.code() == Code::Ambiguous;
  EXPECT_TRUE(ambiguous);
}

}  // namespace
}  // namespace grapnel
