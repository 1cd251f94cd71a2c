#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/field.h"
#include "pipeline/kernels/gaussian_sums.h"
#include "pipeline/neighbours/neighbour_search.h"
#include "pipeline/preprocess/voxel.h"
#include "pipeline/stage.h"

namespace grapnel {

/// What SIFT looks for blobs in.
enum class SiftField : std::uint8_t { Intensity, Depth };

struct SiftParams {
  Engine engine = Engine::Fast;
  SiftField field = SiftField::Intensity;
  double min_scale_m = 0.0;      ///< sigma of the first octave; 0 = auto: min_scale_ratio
  double min_scale_ratio = 1.5;  ///< × the spacing of the surface
  int octaves = 3;
  int scales_per_octave = 3;
  double min_contrast = 0.02;  ///< of the field's unit; intensity is 0…1
};

[[nodiscard]] FieldTable sift_fields() noexcept;

/// Blobs of intensity on a surface: extrema of differences of Gaussians over place and scale (Lowe
/// 2004, as PCL's SIFTKeypoint: each octave thinned to one point a cube of the octave's scale).
/// Keypoints lie at the cubes' centroids (offset_m); score = |difference|, scale = sigma.
/// Errors: TooFewPoints, CapacityExceeded, ColorMissing (no point has an intensity).
class SiftDetector final : public KeypointDetector {
 public:
  explicit SiftDetector(const SiftParams& params) noexcept;

  void reserve(Arena& arena, const Limits& limits) override;
  Status detect(const Surface& surface, KeypointSet& keypoints) noexcept override;

 private:
  struct Extremum {
    Vec3f place = Vec3f::Zero();
    float score = 0.0F;
    float scale_m = 0.0F;
  };

  [[nodiscard]] Status take(const Surface& surface) noexcept;
  void filter_fast(const kernels::GaussianScales& scales, float reach_m) noexcept;
  void filter_plainly(const kernels::GaussianScales& scales, float reach_m) noexcept;
  void find_extrema(std::size_t differences, double octave_scale_m) noexcept;
  [[nodiscard]] bool stands_out(std::size_t point_i, std::size_t difference, float sign,
                                const Neighbourhood& around) const noexcept;
  [[nodiscard]] bool is_extremum(std::size_t point_i, std::size_t difference,
                                 float leaf_m) noexcept;
  [[nodiscard]] Status place(const Surface& surface, KeypointSet& keypoints) noexcept;

  SiftParams params_;
  VoxelGrid voxels_;
  Surface work_;  ///< the octave's points; intensity holds the field
  NeighbourSearch search_;
  std::array<std::span<float>, kernels::kMaxScales> differences_;
  std::span<float> ordered_;                      ///< the field in the search's order
  std::array<std::span<float>, 7> block_planes_;  ///< of PointBlocks
  std::span<Extremum> extrema_;
  std::size_t extremum_count_ = 0;
  bool overflowed_ = false;
  std::span<Keypoint> candidates_;
};

}  // namespace grapnel
