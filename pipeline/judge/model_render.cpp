#include "pipeline/judge/model_render.h"

#include <algorithm>
#include <cmath>

#include "base/assert.h"

namespace grapnel {
namespace {

// Surface seen flatter than 80 degrees is beyond what the sensor reads.
constexpr float kCosGrazing = 0.17F;
constexpr float kMaxDiscPixels = 12.0F;
// Discs drawn at once.
constexpr std::size_t kBatch = 256;

}  // namespace

void ModelRender::reserve(Arena& arena, std::size_t max_pixels, std::size_t max_contour) {
  z_ = arena.take<float>(max_pixels + kernels::kDiscPad);
  point_ = arena.take<std::int32_t>(max_pixels + kernels::kDiscPad);
  discs_ = arena.take<kernels::Disc>(kBatch);
  contour_ = FixedList<ContourPoint>(arena.take<ContourPoint>(max_contour));
}

void ModelRender::render(const Surface& model, const Pose& camera_from_model,
                         const DepthView& view) noexcept {
  box_ = view.box;
  intrinsics_ = view.intrinsics;
  const auto pixels =
      static_cast<std::size_t>(box_.width()) * static_cast<std::size_t>(box_.height());
  GRAPNEL_ASSERT(pixels + kernels::kDiscPad <= z_.size());
  std::fill_n(z_.begin(), pixels, 0.0F);
  marked_ = {box_.u1, box_.v1, box_.u0, box_.v0};

  const Eigen::Matrix3f rotation = camera_from_model.linear().cast<float>();
  const Vec3f shift = camera_from_model.translation().cast<float>();
  const float radius_m = disc_radius_m(model);
  for (std::size_t i = 0; i < model.size; ++i) {
    const Vec3f x = rotation * model.point(i) + shift;
    if (x.z() <= 1e-6F) continue;
    const Vec3f normal = rotation * model.normal(i);
    const float facing = -normal.dot(x);
    if (facing <= 0.0F || facing * facing < kCosGrazing * kCosGrazing * x.squaredNorm()) continue;
    add_disc(static_cast<std::int32_t>(i), x, normal, radius_m);
  }
  draw();
  finish();
  if (marked_.u1 <= marked_.u0) marked_ = {box_.u0, box_.v0, box_.u0, box_.v0};
}

void ModelRender::draw() noexcept {
  kernels::draw_discs(discs_.data(), disc_count_,
                      {z_.data(), point_.data(), box_.u0, box_.v0, box_.width()});
  disc_count_ = 0;
}

void ModelRender::add_disc(std::int32_t i, const Vec3f& x, const Vec3f& normal,
                           float radius_m) noexcept {
  const auto fx = static_cast<float>(intrinsics_.fx);
  const auto fy = static_cast<float>(intrinsics_.fy);
  const auto cx = static_cast<float>(intrinsics_.cx);
  const auto cy = static_cast<float>(intrinsics_.cy);
  const float inverse_z = 1.0F / x.z();
  const float uc = fx * x.x() * inverse_z + cx;
  const float vc = fy * x.y() * inverse_z + cy;
  if (!(uc > -1e5F && uc < 1e5F && vc > -1e5F && vc < 1e5F)) return;
  const float reach = std::min(kMaxDiscPixels, radius_m * fx * inverse_z);
  const int u0 = std::max(box_.u0, static_cast<int>(std::floor(uc - reach + 0.5F)));
  const int u1 = std::min(box_.u1 - 1, static_cast<int>(std::floor(uc + reach + 0.5F)));
  const int v0 = std::max(box_.v0, static_cast<int>(std::floor(vc - reach + 0.5F)));
  const int v1 = std::min(box_.v1 - 1, static_cast<int>(std::floor(vc + reach + 0.5F)));
  if (u0 > u1 || v0 > v1) return;
  marked_.u0 = std::min(marked_.u0, u0);
  marked_.v0 = std::min(marked_.v0, v0);
  marked_.u1 = std::max(marked_.u1, u1 + 1);
  marked_.v1 = std::max(marked_.v1, v1 + 1);

  // 1/z of the disc's plane is affine in the pixel. A steep disc is met far off by the ray, though
  // its own edge is near the pixel: kept within its reach.
  const float over_plane = 1.0F / normal.dot(x);
  const float step_u = normal.x() * over_plane / fx;
  const float step_v = normal.y() * over_plane / fy;
  const float start = normal.z() * over_plane - cx * step_u - cy * step_v;
  kernels::Disc& disc = discs_[disc_count_++];
  disc.start = start;
  disc.step_u = step_u;
  disc.step_v = step_v;
  disc.nearest = 1.0F / std::max(x.z() - 2.0F * radius_m, 0.1F * x.z());
  disc.farthest = 1.0F / (x.z() + 2.0F * radius_m);
  disc.u0 = u0;
  disc.u1 = u1;
  disc.v0 = v0;
  disc.v1 = v1;
  disc.point = i;
  if (disc_count_ == discs_.size()) draw();
}

void ModelRender::finish() noexcept {
  for (int v = marked_.v0; v < marked_.v1; ++v) {
    std::size_t k = index(marked_.u0, v);
    for (int u = marked_.u0; u < marked_.u1; ++u, ++k) {
      if (z_[k] > 0.0F) z_[k] = 1.0F / z_[k];
    }
  }
}

void ModelRender::find_contour(const Surface& model, const Pose& camera_from_model,
                               const DepthView& view) noexcept {
  contour_.clear();
  const std::ptrdiff_t width = box_.width();
  const Eigen::Matrix3f rotation = camera_from_model.linear().cast<float>();
  const Vec3f shift = camera_from_model.translation().cast<float>();
  const auto fx = static_cast<float>(intrinsics_.fx);
  const auto fy = static_cast<float>(intrinsics_.fy);
  const auto covered = [&](int u, int v, float limit) {
    return box_.contains(u, v) && z_[index(u, v)] > 0.0F && z_[index(u, v)] < limit;
  };
  const auto spacing = 4.0F * static_cast<float>(model.spacing_m);
  // At the image's end the part is cut off, not at its own.
  const int u_end = std::min(marked_.u1, box_.u1 - 1);
  const int v_end = std::min(marked_.v1, box_.v1 - 1);
  for (int v = std::max(marked_.v0, box_.v0 + 1); v < v_end; ++v) {
    for (int u = std::max(marked_.u0, box_.u0 + 1); u < u_end; ++u) {
      const float* here = z_.data() + index(u, v);
      const float z = *here;
      if (!(z > 0.0F)) continue;
      const float behind = z + spacing + 8.0F * view.noise.sigma_m(z);
      const float nearest =
          std::min(std::min(here[1], here[-1]), std::min(here[width], here[-width]));
      const float farthest =
          std::max(std::max(here[1], here[-1]), std::max(here[width], here[-width]));
      if (nearest > 0.0F && farthest < behind) continue;
      float out_u = 0.0F;
      float out_v = 0.0F;
      for (int dv = -3; dv <= 3; ++dv) {
        for (int du = -3; du <= 3; ++du) {
          if (covered(u + du, v + dv, behind)) continue;
          out_u += static_cast<float>(du);
          out_v += static_cast<float>(dv);
        }
      }
      const float norm = std::sqrt(out_u * out_u + out_v * out_v);
      if (norm < 1e-3F) continue;
      const std::int32_t i = point_[index(u, v)];
      const Vec3f x = rotation * model.point(static_cast<std::size_t>(i)) + shift;
      const ContourPoint point{fx * x.x() / x.z() + static_cast<float>(intrinsics_.cx),
                               fy * x.y() / x.z() + static_cast<float>(intrinsics_.cy),
                               out_u / norm, out_v / norm, i};
      if (!contour_.push_back(point)) return;
    }
  }
}

}  // namespace grapnel
