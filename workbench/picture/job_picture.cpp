#include "workbench/picture/job_picture.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "workbench/surfaces.h"

namespace grapnel {
namespace {

constexpr int kImage_px = 480;
constexpr double kCounts = 60000.0;
// As the pipeline's match tolerance: 4 mm at the scale of parcels, a fiftieth of small parts.
constexpr double kFloor_m = 0.004;
constexpr double kFloorOfDiameter = 0.02;
// An arrow's length, diameters.
constexpr double kArrow = 0.4;

/// Looks along the cloud's least extent from twice its extent away.
Pose camera_before(const std::vector<Vec3f>& points, double& extent_m) {
  Vec3d mean = Vec3d::Zero();
  for (const Vec3f& p : points) mean += p.cast<double>() / static_cast<double>(points.size());
  Mat3d scatter = Mat3d::Zero();
  extent_m = 1e-3;
  for (const Vec3f& p : points) {
    const Vec3d off = p.cast<double>() - mean;
    scatter += off * off.transpose();
    extent_m = std::max(extent_m, off.norm());
  }
  const Mat3d axes = Eigen::SelfAdjointEigenSolver<Mat3d>(scatter).eigenvectors();
  Pose target_from_camera = Pose::Identity();
  target_from_camera.linear().col(0) = axes.col(2);
  target_from_camera.linear().col(1) = axes.col(1);
  target_from_camera.linear().col(2) = axes.col(2).cross(axes.col(1));
  target_from_camera.translation() = mean - 2.0 * extent_m * target_from_camera.linear().col(2);
  return target_from_camera.inverse();
}

void draw_points(const std::vector<Vec3f>& points, const Pose& camera_from_points, double spacing_m,
                 TargetImage& image) {
  std::vector<float> plane[3];
  for (const Vec3f& p : points) {
    for (int axis = 0; axis < 3; ++axis) plane[axis].push_back(p[axis]);
  }
  PointRender render(image.frame.intrinsics);
  render.add({plane[0], plane[1], plane[2], {}, {}, {}, spacing_m, camera_from_points});
  for (int v = 0; v < image.frame.intrinsics.height; ++v) {
    for (int u = 0; u < image.frame.intrinsics.width; ++u) {
      const double counts = static_cast<double>(render.z_m(u, v)) / image.frame.metres_per_unit;
      image.counts.push_back(static_cast<std::uint16_t>(std::clamp(counts, 0.0, 65535.0)));
    }
  }
}

TargetImage image_of_cloud(const Input& target) {
  TargetImage image;
  const std::vector<Vec3f> points = points_of(target);
  double extent_m = 0.0;
  if (points.empty()) return image;
  const CloudData& cloud = target.cloud();
  const Intrinsics own = cloud.organized() ? fit_intrinsics(cloud) : Intrinsics{};
  if (own.valid()) {
    image.frame.intrinsics = own;
    for (const Vec3f& p : points) extent_m = std::max(extent_m, static_cast<double>(p.z()));
    image.frame.metres_per_unit = extent_m / kCounts;
    draw_points(points, Pose::Identity(), 0.0, image);
  } else {
    image.is_camera = false;
    image.camera_from_target = camera_before(points, extent_m);
    constexpr double kMiddle_px = 0.5 * (kImage_px - 1);
    image.frame.intrinsics = {kImage_px, kImage_px, kImage_px, kImage_px, kMiddle_px, kMiddle_px};
    image.frame.metres_per_unit = 3.2 * extent_m / kCounts;
    draw_points(points, image.camera_from_target, measured_spacing_m(make_surface(cloud)->surface),
                image);
  }
  image.frame.depth = {image.counts.data(), image.frame.intrinsics.width,
                       image.frame.intrinsics.height};
  return image;
}

/// The source's points, with memory of their own for what is no model.
struct SourcePoints {
  std::vector<float> x, y, z;
  PlacedPoints placed;
};

void fill(const DrawnJob& job, SourcePoints& source) {
  if (const Model* model = job.model) {
    source.placed = {model->x,  model->y,  model->z,         model->nx,
                     model->ny, model->nz, model->spacing_m, Pose::Identity()};
    return;
  }
  for (const Vec3f& p : points_of(*job.source)) {
    source.x.push_back(p.x());
    source.y.push_back(p.y());
    source.z.push_back(p.z());
  }
  source.placed = {source.x, source.y, source.z, {}, {}, {}, 0.0, Pose::Identity()};
}

Vec3d middle_of(const PlacedPoints& points) {
  Vec3d sum = Vec3d::Zero();
  for (std::size_t i = 0; i < points.x.size(); ++i) {
    sum += Vec3f(points.x[i], points.y[i], points.z[i]).cast<double>();
  }
  return sum / static_cast<double>(std::max<std::size_t>(points.x.size(), 1));
}

/// The axis whose direction in the image differs most.
int most_turned_axis(const Pose& a, const Pose& b) {
  int most = 0;
  const auto turned = [&](int axis) {
    return (a.linear().col(axis) - b.linear().col(axis)).head<2>().norm();
  };
  for (int axis = 1; axis < 3; ++axis) {
    if (turned(axis) > turned(most)) most = axis;
  }
  return most;
}

DrawnArrow axis_arrow(const Pose& pose, const Vec3d& centre, int axis, double length_m,
                      const Rgb8& color) {
  const Vec3d from = pose * centre;
  return {from, from + length_m * pose.linear().col(axis), color};
}

}  // namespace

TargetImage target_image(const Input& target) {
  if (!target.is_frame()) return image_of_cloud(target);
  TargetImage image;
  image.frame = target.frame();
  return image;
}

RgbImage draw_job(const DrawnJob& job, std::span<const Pose> found,
                  const std::optional<Pose>& truth, PictureParams params) {
  const TargetImage image = target_image(*job.target);
  if (image.frame.depth.empty()) return {};
  SourcePoints source;
  fill(job, source);
  const double diameter_m = job.model != nullptr ? job.model->diameter_m : 1.0;
  params.floor_m = std::min(kFloor_m, kFloorOfDiameter * diameter_m);
  if (!image.is_camera) params.sigma_1m_m = 0.0;
  const auto placed_at = [&](const Pose& target_from_source) {
    PlacedPoints placed = source.placed;
    placed.camera_from_points = image.camera_from_target * target_from_source;
    return placed;
  };
  std::vector<PlacedPoints> poses;
  for (const Pose& pose : found) poses.push_back(placed_at(pose));
  std::vector<PlacedPoints> truths;
  if (truth) truths.push_back(placed_at(*truth));
  std::vector<DrawnArrow> arrows;
  if (job.rival && !found.empty()) {
    const Vec3d centre = middle_of(source.placed);
    const Pose best = image.camera_from_target * found[0];
    const Pose rival = image.camera_from_target * *job.rival;
    const int axis = most_turned_axis(best, rival);
    arrows.push_back(axis_arrow(best, centre, axis, kArrow * diameter_m, kFoundColor));
    arrows.push_back(axis_arrow(rival, centre, axis, kArrow * diameter_m, kRivalColor));
  }
  return draw_scene(image.frame, poses, truths, params, arrows);
}

}  // namespace grapnel
