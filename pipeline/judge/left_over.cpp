#include "pipeline/judge/left_over.h"

#include <algorithm>

namespace grapnel {
namespace {

// In sensor pixels: mixed pixels are this near to the predicted outline, which discs widen already.
constexpr int kOutlineReach_px = 2;
constexpr float kSigmas = 3.0F;

}  // namespace

LeftOver::LeftOver(const ClosestSurface& model, float gap_m, const Pose& camera_from_model,
                   const ModelRender& render, const DepthView& view, float reach_m) noexcept
    : model_(model), render_(render), view_(view), gap_m_(gap_m), reach_m_(reach_m) {
  const Pose inverse = camera_from_model.inverse();
  rotation_ = inverse.linear().cast<float>();
  shift_ = inverse.translation().cast<float>();
}

bool LeftOver::near_picture(int u, int v) const noexcept {
  const int reach = view_.own_px(kOutlineReach_px);
  const PixelBox& marked = render_.marked();
  for (int pv = std::max(marked.v0, v - reach); pv < std::min(marked.v1, v + reach + 1); ++pv) {
    for (int pu = std::max(marked.u0, u - reach); pu < std::min(marked.u1, u + reach + 1); ++pu) {
      if (render_.z_m(pu, pv) > 0.0F) return true;
    }
  }
  return false;
}

bool LeftOver::operator()(int u, int v) const noexcept {
  const bool own = view_.of_object(u, v);
  if (!own && !view_.of_fragment(u, v)) return false;
  if (near_picture(u, v)) return false;
  const float z = view_.z_m(u, v);
  const Vec3f point(static_cast<float>((u - view_.intrinsics.cx) / view_.intrinsics.fx) * z,
                    static_cast<float>((v - view_.intrinsics.cy) / view_.intrinsics.fy) * z, z);
  const Vec3f in_model = rotation_ * point + shift_;
  // A side seen flatter than predicted pictures show is the model's all the same.
  const float on_surface_m = kSigmas * view_.noise.sigma_m(z) + gap_m_;
  if (model_.closest(in_model, on_surface_m) >= 0) return false;
  return own || model_.closest(in_model, reach_m_) >= 0;
}

}  // namespace grapnel
