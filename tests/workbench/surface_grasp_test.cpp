// A grasp from the top of sacks that lie otherwise than the one that was taught, on simulated
// frames whose true surface is known.
#include "pipeline/surface_grasp.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/math.h"
#include "base/rng.h"
#include "drivers/synthetic/scene.h"
#include "drivers/synthetic/scene_renderer.h"
#include "pipeline/registrar.h"
#include "workbench/simulate/part_instance.h"

namespace grapnel {
namespace {

constexpr double kRadius_m = 0.05;  // the preset key's default
constexpr double kBeltDistance_m = 1.1;

std::unique_ptr<Registrar> sack_registrar(const std::vector<std::string>& overrides) {
  const std::filesystem::path config = std::filesystem::path(GRAPNEL_SOURCE_DIR) / "config";
  return Registrar::create(
      load_preset(config / "presets" / "10-sack.toml", config / "models", overrides));
}

/// The belt under a camera that looks straight down.
JobContext on_the_belt() {
  JobContext context;
  context.background.has_plane = true;
  context.background.plane_normal = Vec3d(0.0, 0.0, -1.0);
  context.background.plane_offset_m = kBeltDistance_m;
  return context;
}

/// A scene with one thing, its frame, and what is really there.
class View {
 public:
  View(Mesh mesh, double x_m, double y_m, double yaw_rad, std::uint64_t seed) {
    scene_.seed = seed;
    scene_.frames = 1;
    scene_.camera.color = false;
    scene_.camera.height_m = kBeltDistance_m;
    ScenePart part;
    part.name = "thing";
    part.kind = PartKind::Mesh;
    part.world_from_model = rest_on_belt(mesh, Resting::Upright, x_m, y_m, yaw_rad);
    part.mesh = std::move(mesh);
    scene_.parts.push_back(std::move(part));
    const int width = scene_.camera.width;
    const int height = scene_.camera.height;
    depth_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    renderer_ = std::make_unique<SceneRenderer>(scene_);
    renderer_->render(0, {depth_.data(), width, height}, {});
    frame_.depth = {depth_.data(), width, height};
    frame_.metres_per_unit = scene_.camera.metres_per_unit;
    frame_.intrinsics = scene_.camera.intrinsics();
  }
  View(const View&) = delete;
  View& operator=(const View&) = delete;

  [[nodiscard]] const DepthFrame& frame() const { return frame_; }
  /// True points of the thing in a ball of the footprint's radius about `p`; `all` becomes false
  /// when a pixel there shows something else.
  [[nodiscard]] std::vector<Vec3d> true_points(const Vec3d& p, double radius_m, bool& all) const {
    std::vector<Vec3d> points;
    const Intrinsics& k = frame_.intrinsics;
    const int reach = static_cast<int>(radius_m * k.fx / p.z());
    const int u0 = static_cast<int>(std::lround(k.fx * p.x() / p.z() + k.cx));
    const int v0 = static_cast<int>(std::lround(k.fy * p.y() / p.z() + k.cy));
    all = true;
    for (int v = v0 - reach; v <= v0 + reach; ++v) {
      for (int u = u0 - reach; u <= u0 + reach; ++u) {
        if ((u - u0) * (u - u0) + (v - v0) * (v - v0) > reach * reach) continue;
        if (u < 0 || v < 0 || u >= k.width || v >= k.height ||
            renderer_->part_index().at(u, v) != 0) {
          all = false;
          continue;
        }
        const double z = 1.0 / static_cast<double>(renderer_->surface().inverse_depth.at(u, v));
        points.emplace_back((u - k.cx) / k.fx * z, (v - k.cy) / k.fy * z, z);
      }
    }
    return points;
  }

 private:
  Scene scene_;
  std::unique_ptr<SceneRenderer> renderer_;
  std::vector<std::uint16_t> depth_;
  DepthFrame frame_;
};

/// The filling has moved: other wrinkles, another thickness, the whole bent along its length.
Mesh deformed_sack(std::uint64_t seed) {
  Rng rng(seed);
  const Vec3d size_m(0.5 * rng.uniform(0.9, 1.08), 0.34 * rng.uniform(0.92, 1.1),
                     0.16 * rng.uniform(0.8, 1.15));
  Mesh mesh = make_sack(size_m, 1000 + seed);
  const double bend_per_m = rng.uniform(-0.25, 0.25);
  const double twist_per_m = rng.uniform(-0.3, 0.3);
  for (Vec3d& vertex : mesh.vertices) {
    vertex.z() += bend_per_m * vertex.x() * vertex.x() + twist_per_m * vertex.x() * vertex.y();
    vertex.y() += 0.4 * bend_per_m * vertex.x() * vertex.x();
  }
  return mesh;
}

/// A plane through true points: its normal toward the camera, and how far `p` is off it.
void compare(const std::vector<Vec3d>& points, const Pose& grasp, double& angle_rad,
             double& off_m) {
  Vec3d mean = Vec3d::Zero();
  for (const Vec3d& p : points) mean += p / static_cast<double>(points.size());
  Mat3d scatter = Mat3d::Zero();
  for (const Vec3d& p : points) scatter += (p - mean) * (p - mean).transpose();
  Vec3d normal = Eigen::SelfAdjointEigenSolver<Mat3d>(scatter).eigenvectors().col(0);
  if (normal.z() > 0.0) normal = -normal;
  angle_rad = std::acos(std::min(1.0, -normal.dot(grasp.linear().col(2))));
  off_m = std::fabs(normal.dot(grasp.translation() - mean));
}

TEST(SurfaceGrasp, LiesOnDeformedSacksWithTheirNormalAndAwayFromTheirEdge) {
  const auto registrar = sack_registrar({"surface_grasp.enabled=true"});
  int grasps = 0;
  for (std::uint64_t seed = 1; seed <= 16; ++seed) {
    SCOPED_TRACE(seed);
    Rng rng(seed);
    const View view(deformed_sack(seed), rng.uniform(-0.12, 0.12), rng.uniform(-0.1, 0.1),
                    rng.uniform(0.0, 6.28), seed);
    const Result<RegistrationReports> result = registrar->run(view.frame(), on_the_belt());
    ASSERT_TRUE(result.ok());
    ASSERT_EQ(result.value().objects.size(), 1U);
    const RegistrationReport& report = result.value().objects[0];
    EXPECT_FALSE(report.accepted);  // the taught sack's pose would be wrong on any of them
    if (!report.surface_grasp) continue;
    ++grasps;
    EXPECT_EQ(report.code, Code::SurfaceGrasp);
    EXPECT_EQ(result.value().code, Code::SurfaceGrasp);
    EXPECT_FALSE(report.reasons.empty());  // why the model does not fit stays said
    const Pose& grasp = report.target_from_grasp;
    EXPECT_NEAR(grasp.linear().determinant(), 1.0, 1e-9);
    bool all = false;
    const std::vector<Vec3d> truth = view.true_points(grasp.translation(), 0.9 * kRadius_m, all);
    EXPECT_TRUE(all) << "the footprint hangs over the sack's edge";
    double angle_rad = 0.0;
    double off_m = 0.0;
    compare(truth, grasp, angle_rad, off_m);
    // Readings of 2 mm noise, correlated over 7 px, on a disc of 5 cm: about a degree; the disc of
    // nine tenths and the wrinkles another one.
    EXPECT_LT(angle_rad, 0.06);
    EXPECT_LT(off_m, 0.004);
    EXPECT_LT(grasp.translation().z(), kBeltDistance_m - 0.03);
  }
  EXPECT_GE(grasps, 14);
}

TEST(SurfaceGrasp, IsOffByDefaultAndGivesWayToTheModel) {
  const View other(deformed_sack(3), 0.0, 0.0, 0.4, 3);
  const Result<RegistrationReports> off = sack_registrar({})->run(other.frame(), on_the_belt());
  ASSERT_TRUE(off.ok());
  EXPECT_FALSE(off.value().objects[0].surface_grasp);
  EXPECT_NE(off.value().code, Code::SurfaceGrasp);

  const View taught(make_sack(default_size_m(PartKind::Sack), kModelSackSeed), 0.0, 0.0, 0.4, 3);
  const auto registrar = sack_registrar({"surface_grasp.enabled=true"});
  const Result<RegistrationReports> on = registrar->run(taught.frame(), on_the_belt());
  ASSERT_TRUE(on.ok());
  EXPECT_TRUE(on.value().objects[0].accepted);
  EXPECT_FALSE(on.value().objects[0].surface_grasp);
}

TEST(SurfaceGrasp, IsNotTakenFromAnArmABarrelOrWhatTheImageCutsOff) {
  const auto registrar = sack_registrar({"surface_grasp.enabled=true"});
  const auto offers = [&](const View& view) {
    const Result<RegistrationReports> result = registrar->run(view.frame(), on_the_belt());
    if (!result.ok()) return false;
    for (const RegistrationReport& report : result.value().objects) {
      if (report.surface_grasp || report.accepted) return true;
    }
    return false;
  };
  EXPECT_FALSE(offers(View(make_arm(), 0.1, 0.0, 0.5, 5)));
  // Twice as high as the sack is thick.
  EXPECT_FALSE(offers(View(make_barrel({0.28, 0.28, 0.34}), 0.0, 0.0, 0.0, 6)));
  EXPECT_FALSE(offers(View(deformed_sack(4), 0.55, 0.0, 0.0, 7)));
  EXPECT_FALSE(offers(View(make_box({0.9, 0.5, 0.15}), 0.0, 0.0, 0.2, 8)));
}

TEST(SurfaceGrasp, NeedsAFlatFootprintOfItsSize) {
  const View view(deformed_sack(5), 0.0, 0.0, 0.9, 9);
  const auto report_with = [&](const std::string& limit) {
    const auto registrar = sack_registrar({"surface_grasp.enabled=true", limit});
    const Result<RegistrationReports> result = registrar->run(view.frame(), on_the_belt());
    EXPECT_TRUE(result.ok());
    return result.value().objects[0];
  };
  const RegistrationReport bumpy = report_with("surface_grasp.max_deviation_m=0.0006");
  EXPECT_FALSE(bumpy.surface_grasp);
  EXPECT_EQ(bumpy.reasons[bumpy.reasons.size() - 1].code(), Code::NoSurfaceGrasp);
  const RegistrationReport wide = report_with("surface_grasp.radius_m=0.3");
  EXPECT_FALSE(wide.surface_grasp);
  EXPECT_EQ(wide.reasons[wide.reasons.size() - 1].check, Check::GraspPatch);
}

}  // namespace
}  // namespace grapnel
