#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/keypoints/maxima.h"
#include "pipeline/neighbours/sphere_sums.h"
#include "pipeline/stage.h"

namespace grapnel {

struct IssParams {
  Engine engine = Engine::Fast;
  double salient_radius_m = 0.0;  ///< 0 = auto: 6 spacings, as PCL's example
  double non_max_radius_m = 0.0;  ///< 0 = auto: 4 spacings
  double gamma_21 = 0.975;        ///< largest ratio of second to first eigenvalue
  double gamma_32 = 0.975;        ///< largest ratio of third to second eigenvalue
  int min_neighbours = 5;         ///< the point included
  /// Divides the scatter by the neighbour count, so that near surfaces (more points) are not
  /// preferred. PCL: false.
  bool normalise = true;
  double min_third_eigenvalue_m2 = 0.0;  ///< below it, saliency is noise; PCL: 0
  double border_radius_m = 0.0;          ///< > 0: no keypoints this near to a border. PCL: 0
  double border_angle_rad =
      1.0471975511965976;  ///< gap between neighbours that makes a border: π/3
};

[[nodiscard]] FieldTable iss_fields() noexcept;

/// Intrinsic shape signatures: points whose scatter differs in all three directions and whose
/// smallest eigenvalue is the largest around (Zhong 2009; scatter about the point and without
/// weights, as PCL's ISSKeypoint3D). Score = the smallest eigenvalue. Borders need normals.
class IssDetector final : public KeypointDetector {
 public:
  explicit IssDetector(const IssParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  Status detect(const Surface& surface, KeypointSet& keypoints) noexcept override;

 private:
  void find_borders(const Surface& surface) noexcept;
  [[nodiscard]] float saliency(double count, double e1, double e2, double e3) const noexcept;
  void measure_fast(const Surface& surface) noexcept;
  void measure_plainly(const Surface& surface, double salient_radius_m) noexcept;

  IssParams params_;
  SphereSums sums_;
  LocalMaxima maxima_;
  std::span<float> saliency_;
  std::array<std::span<float>, 3> eigenvalues_;  ///< ascending
  std::span<std::uint8_t> edge_, border_;        ///< on a border; near one
  std::span<float> angles_;
};

}  // namespace grapnel
