#pragma once

#include "base/field.h"
#include "pipeline/stage.h"

namespace grapnel {

struct SurfaceNormalRejectorParams {
  double min_cos = 0.5;  ///< of the angle between the normals of a pair's ends
};
[[nodiscard]] FieldTable surface_normal_rejector_fields() noexcept;

/// Keeps pairs whose normals point the same way (PCL's CorrespondenceRejectorSurfaceNormal): for
/// surfaces that lie in one frame already. A pair without a normal is dropped.
class SurfaceNormalRejector final : public CorrespondenceRejector {
 public:
  explicit SurfaceNormalRejector(const SurfaceNormalRejectorParams& params) : params_(params) {}

  void reserve(Arena&, const Limits&) override {}
  Status reject(const PairView& pair, Correspondences& correspondences, Rng& rng) noexcept override;

 private:
  SurfaceNormalRejectorParams params_;
};

}  // namespace grapnel
