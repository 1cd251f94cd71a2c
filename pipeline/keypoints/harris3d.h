#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/keypoints/maxima.h"
#include "pipeline/neighbours/sphere_sums.h"
#include "pipeline/neighbours/symmetric3.h"
#include "pipeline/stage.h"

namespace grapnel {

/// How a point's response follows from the covariance C of the normals around it.
enum class HarrisResponse : std::uint8_t {
  Harris,    ///< 0.04 + det C - 0.04 trace² C
  Noble,     ///< det C / trace C
  Lowe,      ///< det C / trace² C
  Tomasi,    ///< smallest eigenvalue of C
  Curvature  ///< surface variation of the points in the sphere
};

struct HarrisParams {
  Engine engine = Engine::Fast;
  HarrisResponse response = HarrisResponse::Harris;
  double radius_m = 0.0;      ///< of the covariance, of the suppression; 0 = auto: radius_ratio
  double radius_ratio = 5.0;  ///< × the spacing of the surface
  /// Responses below it are no keypoints; PCL: 0, which keeps the rounding of flat surfaces.
  double threshold = 1e-4;
  bool suppress = true;  ///< only maxima within the radius; false: every point above the threshold
  bool refine = true;    ///< moves keypoints to where the tangent planes around them meet
};

[[nodiscard]] FieldTable harris_fields() noexcept;

/// Corners of a surface by the spread of its normals (PCL's HarrisKeypoint3D). With unit normals
/// trace C is 1, so harris, noble and lowe choose the same points. Score = the response. Points
/// without normal do not count.
class HarrisDetector final : public KeypointDetector {
 public:
  explicit HarrisDetector(const HarrisParams& params) noexcept : params_(params) {}

  void reserve(Arena& arena, const Limits& limits) override;
  Status detect(const Surface& surface, KeypointSet& keypoints) noexcept override;

  /// Every point's response of the last surface.
  [[nodiscard]] std::span<const float> responses() const noexcept { return last_; }

 private:
  void respond_fast(const Surface& surface) noexcept;
  void respond_plainly(const Surface& surface, double radius_m) noexcept;
  void refine(const Surface& surface, double radius_m, KeypointSet& keypoints) noexcept;

  HarrisParams params_;
  SphereSums sums_;
  LocalMaxima maxima_;
  std::span<float> response_;
  std::span<const float> last_;
  std::array<std::span<float>, 3> eigenvalues_;
};

}  // namespace grapnel
