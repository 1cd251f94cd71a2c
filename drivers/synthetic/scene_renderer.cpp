#include "drivers/synthetic/scene_renderer.h"

#include <algorithm>
#include <cmath>

#include "base/assert.h"
#include "drivers/synthetic/texture.h"

namespace grapnel {
namespace {

constexpr std::int16_t kBelt = -1;

int projector_margin_px(const Scene& scene) {
  return static_cast<int>(scene.camera.fx * scene.camera.baseline_m / scene.sensor.min_range_m) + 2;
}

/// The camera moved to the projector, its image widened to the left by `margin_px`.
Intrinsics projector_intrinsics(Intrinsics intrinsics, int margin_px) {
  intrinsics.width += margin_px;
  intrinsics.cx += margin_px;
  return intrinsics;
}

}  // namespace

SceneRenderer::SceneRenderer(const Scene& scene)
    : scene_(scene),
      intrinsics_(scene.camera.intrinsics()),
      camera_from_world_(scene.camera.world_from_camera().inverse()),
      camera_(intrinsics_),
      projector_offset_px_(projector_margin_px(scene)),
      projector_(projector_intrinsics(intrinsics_, projector_offset_px_)),
      sensor_(intrinsics_, scene.camera.baseline_m, scene.camera.metres_per_unit, scene.sensor) {
  GRAPNEL_ASSERT(scene.parts.size() < 32767);
  const std::size_t pixels = pixel_of(0, intrinsics_.height);
  inverse_depth_.resize(pixels);
  cos_incidence_.resize(pixels);
  albedo_.resize(pixels);
  part_index_.resize(pixels);
  visible_.resize(scene.parts.size());
  look_at_belt();
}

void SceneRenderer::look_at_belt() {
  const std::size_t pixels = pixel_of(0, intrinsics_.height);
  ray_scale_.resize(pixels);
  belt_inverse_depth_.resize(pixels);
  belt_x_m_.resize(pixels);
  belt_y_m_.resize(pixels);
  const Pose world_from_camera = camera_from_world_.inverse();
  const Vec3d normal = camera_from_world_.linear().col(2);
  const double offset = normal.dot(camera_from_world_.translation());
  belt_normal_ = normal.cast<float>();
  belt_light_ = light_on(belt_normal_);
  for (int v = 0; v < intrinsics_.height; ++v) {
    for (int u = 0; u < intrinsics_.width; ++u) {
      const Vec3d ray((u - intrinsics_.cx) / intrinsics_.fx, (v - intrinsics_.cy) / intrinsics_.fy,
                      1.0);
      const std::size_t pixel = pixel_of(u, v);
      ray_scale_[pixel] = static_cast<float>(1.0 / std::sqrt(ray.squaredNorm()));
      const double inverse_z = normal.dot(ray) / offset;
      if (!(inverse_z > 1e-3)) continue;
      const Vec3d point = world_from_camera * Vec3d(ray / inverse_z);
      belt_inverse_depth_[pixel] = static_cast<float>(inverse_z);
      belt_x_m_[pixel] = static_cast<float>(point.x());
      belt_y_m_[pixel] = static_cast<float>(point.y());
    }
  }
}

void SceneRenderer::render(std::int64_t frame, ImageView<std::uint16_t> depth,
                           ImageView<Rgb8> color) {
  const double travel_m = belt_travel_m(scene_, frame);
  if (rendered_ < 0 || travel_m != travel_m_) {
    travel_m_ = travel_m;
    draw_parts(frame);
    merge();
    painted_ = false;
  }
  rendered_ = frame;
  sensor_.measure(surface(), scene_.seed, static_cast<std::uint64_t>(frame), depth);
  for (PartView& view : views_) view.measured_pixels = 0;
  std::fill(visible_.begin(), visible_.end(), 0);
  for (int v = 0; v < intrinsics_.height; ++v) {
    const std::uint16_t* row = depth.row(v);
    const std::int16_t* part = part_index_.data() + pixel_of(0, v);
    for (int u = 0; u < intrinsics_.width; ++u) {
      if (part[u] != kBelt && row[u] != 0) ++visible_[static_cast<std::size_t>(part[u])];
    }
  }
  for (PartView& view : views_) view.measured_pixels = visible_[view.part_i];
  if (color.empty()) return;
  if (!painted_) paint();
  painted_ = true;
  for (int v = 0; v < intrinsics_.height; ++v) {
    std::copy_n(color_.data() + pixel_of(0, v), intrinsics_.width, color.row(v));
  }
}

void SceneRenderer::draw_parts(std::int64_t frame) {
  camera_.clear();
  projector_.clear();
  faces_.clear();
  views_.clear();
  for (std::size_t i = 0; i < scene_.parts.size(); ++i) {
    draw_part(i, camera_from_world_ * world_from_part(scene_, scene_.parts[i], frame));
  }
}

void SceneRenderer::draw_part(std::size_t part_i, const Pose& camera_from_model) {
  const ScenePart& part = scene_.parts[part_i];
  const auto first_face = static_cast<std::int32_t>(faces_.size());
  PartView view;
  view.part_i = part_i;
  view.camera_from_model = camera_from_model;
  const Rasterizer::Outline outline = camera_.draw(part.mesh, camera_from_model, first_face);
  view.covered_pixels = outline.pixels;
  view.inside = outline.inside;
  Pose projector_from_model = camera_from_model;
  projector_from_model.translation().x() -= scene_.camera.baseline_m;
  projector_.draw(part.mesh, projector_from_model, 0);
  if (view.covered_pixels == 0) return;
  const Mat3d rotation = camera_from_model.linear();
  for (std::size_t i = 0; i < part.mesh.triangles.size(); ++i) {
    faces_.push_back({(rotation * triangle_normal(part.mesh, i)).cast<float>(),
                      static_cast<std::int16_t>(part_i)});
  }
  views_.push_back(view);
}

void SceneRenderer::merge() {
  std::fill(visible_.begin(), visible_.end(), 0);
  const auto belt_albedo = static_cast<float>(scene_.belt.albedo);
  for (int v = 0; v < intrinsics_.height; ++v) {
    const float* inverse_depth = camera_.inverse_depth().row(v);
    const std::int32_t* face_row = camera_.face().row(v);
    const auto ray_y = static_cast<float>((v - intrinsics_.cy) / intrinsics_.fy);
    for (int u = 0; u < intrinsics_.width; ++u) {
      const std::size_t pixel = pixel_of(u, v);
      const bool part = inverse_depth[u] > belt_inverse_depth_[pixel];
      Vec3f normal = belt_normal_;
      part_index_[pixel] = kBelt;
      albedo_[pixel] = belt_albedo;
      if (part) {
        const Face& face = faces_[static_cast<std::size_t>(face_row[u])];
        const auto part_i = static_cast<std::size_t>(face.part_i);
        normal = face.normal_camera;
        part_index_[pixel] = face.part_i;
        albedo_[pixel] = static_cast<float>(scene_.parts[part_i].albedo);
        ++visible_[part_i];
      }
      inverse_depth_[pixel] = part ? inverse_depth[u] : belt_inverse_depth_[pixel];
      const auto ray_x = static_cast<float>((u - intrinsics_.cx) / intrinsics_.fx);
      const float along = normal.x() * ray_x + normal.y() * ray_y + normal.z();
      cos_incidence_[pixel] = std::max(0.0f, -along * ray_scale_[pixel]);
    }
  }
  for (PartView& view : views_) view.visible_pixels = visible_[view.part_i];
}

SurfaceImages SceneRenderer::surface() const {
  const int width = intrinsics_.width;
  const int height = intrinsics_.height;
  SurfaceImages images;
  images.inverse_depth = {inverse_depth_.data(), width, height};
  images.cos_incidence = {cos_incidence_.data(), width, height};
  images.albedo = {albedo_.data(), width, height};
  images.projector_inverse_depth = projector_.inverse_depth();
  images.projector_offset_px = projector_offset_px_;
  return images;
}

ImageView<const std::int16_t> SceneRenderer::part_index() const {
  return {part_index_.data(), intrinsics_.width, intrinsics_.height};
}

Vec3f SceneRenderer::normal_at(int u, int v) const {
  if (part_index_[pixel_of(u, v)] == kBelt) return belt_normal_;
  return faces_[static_cast<std::size_t>(camera_.face().at(u, v))].normal_camera;
}

void SceneRenderer::paint() {
  color_.resize(part_index_.size());
  std::vector<Texture> textures(scene_.parts.size());
  std::vector<Pose> model_from_camera(scene_.parts.size());
  for (const PartView& view : views_) {
    const ScenePart& part = scene_.parts[view.part_i];
    textures[view.part_i] = Texture(part.kind, part.albedo, view.part_i);
    model_from_camera[view.part_i] = view.camera_from_model.inverse();
  }
  for (int v = 0; v < intrinsics_.height; ++v) {
    for (int u = 0; u < intrinsics_.width; ++u) {
      const std::size_t pixel = pixel_of(u, v);
      if (part_index_[pixel] == kBelt) {
        color_[pixel] = paint_belt(pixel);
        continue;
      }
      const auto part_i = static_cast<std::size_t>(part_index_[pixel]);
      const double z_m = 1.0 / static_cast<double>(inverse_depth_[pixel]);
      const Vec3d point((u - intrinsics_.cx) / intrinsics_.fx * z_m,
                        (v - intrinsics_.cy) / intrinsics_.fy * z_m, z_m);
      color_[pixel] = textures[part_i].color_at(model_from_camera[part_i] * point, normal_at(u, v));
    }
  }
}

Rgb8 SceneRenderer::paint_belt(std::size_t pixel) const {
  if (belt_inverse_depth_[pixel] == 0.0f) return {};
  const double cycle_m = scene_.belt.pitch_m * scene_.belt.stations;
  double along_m = static_cast<double>(belt_x_m_[pixel]) - travel_m_;
  if (cycle_m > 0.0 && along_m < 0.0) {
    along_m += cycle_m * static_cast<double>(1 + static_cast<std::int64_t>(-along_m / cycle_m));
  }
  return belt_color(along_m, static_cast<double>(belt_y_m_[pixel]), belt_light_);
}

}  // namespace grapnel
