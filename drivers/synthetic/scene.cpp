#include "drivers/synthetic/scene.h"

#include "base/math.h"

namespace grapnel {
namespace {

Mat3d resting_rotation(Resting resting) {
  Mat3d rotation = Mat3d::Identity();
  switch (resting) {
    case Resting::Upright:
      break;
    case Resting::UpsideDown:  // half turn about x
      rotation << 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0;
      break;
    case Resting::OnSide:  // quarter turn about x: the model's y axis points up
      rotation << 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0;
      break;
    case Resting::OnEnd:  // quarter turn about y: the model's x axis points up
      rotation << 0.0, 0.0, -1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0;
      break;
  }
  return rotation;
}

}  // namespace

Pose SceneCamera::world_from_camera() const {
  Mat3d looking_down;
  looking_down << 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0;
  Pose pose = Pose::Identity();
  pose.linear() = looking_down * rotation_from_vector({tilt_rad, 0.0, 0.0});
  pose.translation() = Vec3d(x_m, y_m, height_m);
  return pose;
}

Pose rest_on_belt(const Mesh& mesh, Resting resting, double x_m, double y_m, double yaw_rad) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_vector({0.0, 0.0, yaw_rad}) * resting_rotation(resting);
  pose.translation() = Vec3d(x_m, y_m, -lowest_z_m(mesh, pose.linear()));
  return pose;
}

double belt_travel_m(const Scene& scene, std::int64_t frame) {
  const Belt& belt = scene.belt;
  if (belt.pitch_m <= 0.0) return belt.speed_m_s * static_cast<double>(frame) / scene.rate_hz;
  const std::int64_t period = belt.period_frames();
  const std::int64_t moving = frame % period - belt.dwell_frames + 1;
  const double share = moving > 0 ? static_cast<double>(moving) / (belt.move_frames + 1) : 0.0;
  const std::int64_t whole = frame / period;
  return belt.pitch_m * (static_cast<double>(whole) + share);
}

Pose world_from_part(const Scene& scene, const ScenePart& part, std::int64_t frame) {
  Pose pose = part.world_from_model;
  const Belt& belt = scene.belt;
  if (belt.pitch_m <= 0.0) {
    pose.translation().x() += belt_travel_m(scene, frame);
    return pose;
  }
  // Whole stations first: at its own dwell a part is exactly where its description puts it.
  const std::int64_t period = belt.period_frames();
  const std::int64_t stations = belt.stations;
  const double share =
      belt_travel_m(scene, frame % period) / belt.pitch_m;  // 0…1 of the way to the next station
  std::int64_t ahead = ((frame / period - part.station) % stations + stations) % stations;
  if (static_cast<double>(ahead) + share > 0.5 * static_cast<double>(stations)) ahead -= stations;
  pose.translation().x() += belt.pitch_m * (static_cast<double>(ahead) + share);
  return pose;
}

std::int64_t first_dwell_frame(const Scene& scene, int station) {
  return scene.belt.pitch_m > 0.0 ? std::int64_t{station} * scene.belt.period_frames() : 0;
}

}  // namespace grapnel
