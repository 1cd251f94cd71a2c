#include "pipeline/judge/model_render.h"

#include <algorithm>
#include <cmath>

#include "base/assert.h"

namespace grapnel {
namespace {

// Surface seen flatter than 80 degrees is beyond what the sensor reads.
constexpr float kCosGrazing = 0.17F;
constexpr float kMaxDiscPixels = 12.0F;
// Points whose discs are drawn at once.
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

  kernels::DiscLaw law;
  law.fx = static_cast<float>(intrinsics_.fx);
  law.fy = static_cast<float>(intrinsics_.fy);
  law.cx = static_cast<float>(intrinsics_.cx);
  law.cy = static_cast<float>(intrinsics_.cy);
  law.radius_m = disc_radius_m(model);
  law.least_cosine_square = kCosGrazing * kCosGrazing;
  law.most_px = kMaxDiscPixels;
  law.u0 = box_.u0;
  law.v0 = box_.v0;
  law.u1 = box_.u1;
  law.v1 = box_.v1;
  const kernels::OrientedPlanes points{model.x.data(),  model.y.data(),  model.z.data(),
                                       model.nx.data(), model.ny.data(), model.nz.data()};
  const kernels::Motion motion = kernels::motion_of(camera_from_model);
  const kernels::DiscImage image{z_.data(), point_.data(), box_.u0, box_.v0, box_.width()};
  kernels::DiscBounds bounds{box_.u1, box_.v1, box_.u0, box_.v0};
  for (std::size_t first = 0; first < model.size; first += kBatch) {
    const std::size_t discs = kernels::lay_discs(
        points, first, std::min(kBatch, model.size - first), motion, law, discs_.data(), bounds);
    kernels::draw_discs(discs_.data(), discs, image);
  }
  marked_ = {bounds.u0, bounds.v0, bounds.u1, bounds.v1};
  finish();
  if (marked_.u1 <= marked_.u0) marked_ = {box_.u0, box_.v0, box_.u0, box_.v0};
}

void ModelRender::finish() noexcept {
  for (int v = marked_.v0; v < marked_.v1; ++v) {
    std::size_t k = index(marked_.u0, v);
    for (int u = marked_.u0; u < marked_.u1; ++u, ++k) {
      z_[k] = z_[k] > 0.0F ? 1.0F / z_[k] : 0.0F;
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
