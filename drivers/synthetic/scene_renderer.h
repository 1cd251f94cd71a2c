#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/geometry.h"
#include "base/image.h"
#include "drivers/synthetic/rasterizer.h"
#include "drivers/synthetic/scene.h"
#include "drivers/synthetic/structured_light.h"

namespace grapnel {

/// The truth about one part in one frame.
struct PartView {
  std::size_t part_i = 0;  ///< index of Scene::parts
  Pose camera_from_model = Pose::Identity();
  std::size_t covered_pixels = 0;   ///< of its outline inside the image, hidden ones included
  std::size_t visible_pixels = 0;   ///< of these not hidden by another part
  std::size_t measured_pixels = 0;  ///< of these with a reading
  bool inside = false;              ///< its whole outline lies inside the image
};

/// Renders a scene frame by frame, in any order: a frame is a function of scene and number alone.
/// What stands still is rendered once.
class SceneRenderer {
 public:
  /// Keeps a reference to the scene.
  explicit SceneRenderer(const Scene& scene);

  /// Fills depth (counts, 0 = no reading) and, where the view is not empty, colour.
  void render(std::int64_t frame, ImageView<std::uint16_t> depth, ImageView<Rgb8> color);

  /// Parts that cover at least one pixel of the frame rendered last, in the scene's order.
  [[nodiscard]] std::span<const PartView> parts() const { return views_; }
  /// Surfaces of the frame rendered last, without the sensor's errors.
  [[nodiscard]] SurfaceImages surface() const;
  /// Index of Scene::parts per pixel of the frame rendered last; -1 is the belt.
  [[nodiscard]] ImageView<const std::int16_t> part_index() const;
  /// Unit normals of the frame's part faces in the camera frame, per pixel; the belt's elsewhere.
  [[nodiscard]] Vec3f normal_at(int u, int v) const;

 private:
  struct Face {
    Vec3f normal_camera;
    std::int16_t part_i;
  };

  void look_at_belt();
  void draw_parts(std::int64_t frame);
  void draw_part(std::size_t part_i, const Pose& camera_from_model);
  void merge();
  void paint();
  [[nodiscard]] Rgb8 paint_belt(std::size_t pixel) const;
  [[nodiscard]] std::size_t pixel_of(int u, int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(intrinsics_.width) +
           static_cast<std::size_t>(u);
  }

  const Scene& scene_;
  Intrinsics intrinsics_;
  Pose camera_from_world_;
  Rasterizer camera_;
  int projector_offset_px_;
  Rasterizer projector_;
  StructuredLight sensor_;

  Vec3f belt_normal_;
  float belt_light_ = 0.0f;
  std::vector<float> ray_scale_;           // 1 / length of the ray (x/z, y/z, 1)
  std::vector<float> belt_inverse_depth_;  // 0 where the ray misses the belt
  std::vector<float> belt_x_m_, belt_y_m_;

  std::vector<Face> faces_;
  std::vector<PartView> views_;
  std::vector<std::size_t> visible_;  // per part
  std::vector<float> inverse_depth_, cos_incidence_, albedo_;
  std::vector<std::int16_t> part_index_;
  std::vector<Rgb8> color_;
  bool painted_ = false;        // color_ shows the surfaces that are held
  std::int64_t rendered_ = -1;  // frame whose surfaces are held
  double travel_m_ = 0.0;
};

}  // namespace grapnel
