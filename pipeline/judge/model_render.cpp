#include "pipeline/judge/model_render.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/assert.h"
#include "pipeline/kernels/outline_pixels.h"

namespace grapnel {
namespace {

// Surface seen flatter than 80 degrees is beyond what the sensor reads.
constexpr float kCosGrazing = 0.17F;
constexpr float kMaxDiscPixels = 12.0F;
// Pixels of a row that are looked through at once.
constexpr int kStretch_px = 256;
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
  contour_.clear();
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
  if (marked_.u1 <= marked_.u0) marked_ = {box_.u0, box_.v0, box_.u0, box_.v0};
  finish();
}

void ModelRender::finish() noexcept {
  float largest = 0.0F;
  for (int v = marked_.v0; v < marked_.v1; ++v) {
    largest = std::max(largest, kernels::invert_row(z_.data() + index(marked_.u0, v),
                                                    static_cast<std::size_t>(marked_.width())));
  }
  nearest_m_ = largest > 0.0F ? 1.0F / largest : 0.0F;
}

void ModelRender::find_contour(const Surface& model, const Pose& camera_from_model,
                               const DepthView& view) noexcept {
  contour_.clear();
  const Eigen::Matrix3f rotation = camera_from_model.linear().cast<float>();
  const Vec3f shift = camera_from_model.translation().cast<float>();
  kernels::OutlineLaw law;
  law.slack_m = 4.0F * static_cast<float>(model.spacing_m);
  law.sigma_per_m2 = view.noise.sigma_per_m2;
  law.sigma_floor_m = view.noise.floor_m;
  // At the image's end the part is cut off, not at its own.
  const int u_begin = std::max(marked_.u0, box_.u0 + 1);
  const int u_end = std::min(marked_.u1, box_.u1 - 1);
  const int v_end = std::min(marked_.v1, box_.v1 - 1);
  std::array<std::int32_t, kStretch_px + kernels::kOutlinePad> found;
  std::array<float, kStretch_px> out_u;
  std::array<float, kStretch_px> out_v;
  for (int v = std::max(marked_.v0, box_.v0 + 1); v < v_end; ++v) {
    for (int first = u_begin; first < u_end; first += kStretch_px) {
      const int count = std::min(u_end - first, kStretch_px);
      const std::size_t outline =
          kernels::outline_pixels(z_.data() + index(first, v), box_.width(),
                                  static_cast<std::size_t>(count), law, found.data());
      const bool whole_rows =
          v - kernels::kOutwardReach >= box_.v0 && v + kernels::kOutwardReach < box_.v1;
      if (whole_rows) {
        kernels::outward_of(z_.data() + index(first, v), box_.width(), found.data(), outline, law,
                            out_u.data(), out_v.data());
      }
      for (std::size_t k = 0; k < outline; ++k) {
        const int u = first + found[k];
        if (!whole_rows || u - kernels::kOutwardReach < box_.u0 ||
            u + kernels::kOutwardReach >= box_.u1) {
          look_around(u, v, kernels::behind_m(law, z_[index(u, v)]), out_u[k], out_v[k]);
        }
        const float norm = std::sqrt(out_u[k] * out_u[k] + out_v[k] * out_v[k]);
        if (norm < 1e-3F) continue;
        const std::int32_t i = point_[index(u, v)];
        const Vec3f x = rotation * model.point(static_cast<std::size_t>(i)) + shift;
        const auto fx = static_cast<float>(intrinsics_.fx);
        const auto fy = static_cast<float>(intrinsics_.fy);
        const ContourPoint point{fx * x.x() / x.z() + static_cast<float>(intrinsics_.cx),
                                 fy * x.y() / x.z() + static_cast<float>(intrinsics_.cy),
                                 out_u[k] / norm, out_v[k] / norm, i};
        if (!contour_.push_back(point)) return;
      }
    }
  }
}

bool ModelRender::at_step(int u, int v, int reach, float limit_m) const noexcept {
  const float predicted = z_m(u, v);
  for (const auto& [du, dv] : {std::array{reach, 0}, std::array{0, reach}}) {
    if (!box_.contains(u + du, v + dv) || !box_.contains(u - du, v - dv)) return true;
    const float after = z_m(u + du, v + dv);
    const float before = z_m(u - du, v - dv);
    // A slope has no second difference, a step has.
    if (!(after > 0.0F && before > 0.0F)) return true;
    if (std::fabs(after + before - 2.0F * predicted) > limit_m) return true;
  }
  return false;
}

void ModelRender::look_around(int u, int v, float behind_m, float& out_u,
                              float& out_v) const noexcept {
  constexpr int kReach = kernels::kOutwardReach;
  out_u = 0.0F;
  out_v = 0.0F;
  for (int dv = -kReach; dv <= kReach; ++dv) {
    for (int du = -kReach; du <= kReach; ++du) {
      const float z = box_.contains(u + du, v + dv) ? z_[index(u + du, v + dv)] : 0.0F;
      if (z > 0.0F && z < behind_m) continue;
      out_u += static_cast<float>(du);
      out_v += static_cast<float>(dv);
    }
  }
}

}  // namespace grapnel
