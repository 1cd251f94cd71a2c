#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "base/arena.h"
#include "pipeline/judge/depth_view.h"
#include "pipeline/judge/left_over.h"
#include "pipeline/judge/model_render.h"
#include "pipeline/kernels/compare_row.h"
#include "pipeline/surface.h"

namespace grapnel {

/// What the measurement says about a pose, apart from how it was found. Shares are of the pixels
/// that the model should fill; matched + seen_through + occluded + unknown = 1.
struct Evidence {
  double matched = 0.0;
  double seen_through = 0.0;  ///< measured behind the model: free space violated
  double occluded = 0.0;      ///< measured before the model
  double unknown = 0.0;       ///< no reading
  double matched_area_m2 = 0.0;
  double hole_area_m2 = 0.0;  ///< largest connected piece that is seen through
  /// Largest piece at a depth that the model does not have there: along its edges, where single
  /// pixels are left out; or of the object itself, or what lies against it, before the model.
  double stray_area_m2 = 0.0;
  std::uint32_t pixels = 0;  ///< counted: visible model, its rim left out
  double rmse_m = 0.0;       ///< point-to-plane, of matched pixels
  double edge = 0.0;         ///< share of the known outline that meets a depth edge
  double edge_known = 0.0;   ///< share of the unhidden outline that readings say anything about
  double beside_belt = 0.0;  ///< share of the unhidden outline beside which the belt is read
  double unexplained = 0.0;  ///< object's pixels within and beside the outline the model leaves
                             ///< over, as a share of the matched ones
  double explained = 0.0;    ///< share of the whole object's pixels the model explains
  double coverage = 0.0;     ///< share of the model's points confirmed
  double second_face = 0.0;  ///< share of matched area not along the main normal: 1 - largest
                             ///< eigenvalue of the mean n nᵀ
};

/// Worth of a pose for comparing candidates:
/// S = matched - 2 · seen_through - unexplained / 2 - edge_known · (1 - edge) / 2.
[[nodiscard]] double worth(const Evidence& evidence) noexcept;

/// Compares the depth image that the model should give with the one measured.
class Verification {
 public:
  void reserve(Arena& arena, std::size_t max_pixels, std::size_t max_model_points);

  /// `render` holds the model at the pose, contour included; `edges` belongs to `view`. A pixel
  /// matches when the measured point lies within max(3 sigma, floor) of the model's tangent plane
  /// and, where the model is flat over the measured normals' neighbourhood, the normals agree.
  /// Without `whole` only what worth() asks is found. O(pixels of the model).
  Evidence verify(const Surface& model, std::span<const std::uint8_t> flat,
                  const Pose& camera_from_model, const ModelRender& render, const DepthView& view,
                  const EdgeMap& edges, double floor_m, bool whole = true) noexcept;

  /// Largest connected piece that a pose leaves over, squared metres; `render` as for verify().
  /// O(pixels of the view's box).
  double left_over_m2(const LeftOver& left_over, const ModelRender& render,
                      const DepthView& view) noexcept;

 private:
  enum class Kind : std::uint8_t {
    Outside,
    Rim,
    Stray,     ///< on the rim, and nowhere near what is predicted there
    LeftOver,  ///< see there
    InFront,   ///< before the model, but no other thing
    Piece,     ///< upper left of a square of one of those
    Matched,
    SeenThrough,
    Occluded,
    Unknown,
    Support,
    kCount
  };

  struct Sums;
  struct Stretch;
  /// Whether the prediction ends or has a step there is asked this far around, pixels of the view.
  [[nodiscard]] static int rim_of(const Surface& model, const ModelRender& render,
                                  const DepthView& view) noexcept;
  /// Compares `count` pixels of a row with the measurement.
  void compare(const Surface& model, const ModelRender& render, const DepthView& view, int u, int v,
               int count, Stretch& stretch) const noexcept;
  /// Pixels from which the rim reaches out of the box: there the prediction ends.
  void cut_off(const ModelRender& render, int u, int v, int count, Stretch& stretch) const noexcept;
  /// Kinds of that stretch's pixels, and what they add to the sums.
  void classify(const ModelRender& render, const DepthView& view, int u, int v, int count,
                const Stretch& stretch, Sums& sums) noexcept;
  /// The working surface's normal at a pixel speaks against a match.
  [[nodiscard]] bool faces_elsewhere(const DepthView& view, std::int32_t working,
                                     const Stretch& stretch, std::size_t k) const noexcept;
  /// Whether a reading on the rim is that of some prediction within the rim's reach.
  [[nodiscard]] bool explained_at_rim(const ModelRender& render, const DepthView& view, int u,
                                      int v, int rim, float limit_m) const noexcept;
  /// Largest connected piece of kind `of` that holds a pixel of kind `seed`, squared metres; the
  /// pixels lose their kind.
  double largest_piece_m2(Kind seed, Kind of, const PixelBox& box, const ModelRender& render,
                          const DepthView& view) noexcept;
  /// Largest connected piece that is somewhere broader than mixed pixels make it.
  double broad_piece_m2(Kind of, const PixelBox& box, const ModelRender& render,
                        const DepthView& view) noexcept;
  /// Column of the working grid of every column of the box, -1 = none, into stack_.
  void working_columns(const DepthView& view, const PixelBox& box) noexcept;
  void outline(const ModelRender& render, const DepthView& view, const EdgeMap& edges,
               Evidence& evidence) const noexcept;

  kernels::Motion motion_;
  kernels::CompareLaw law_;
  std::span<const std::uint8_t> flat_;
  std::span<Kind> kind_;
  std::span<std::int32_t> stack_;  ///< before pieces are looked for: see working_columns()
  std::span<std::uint8_t> confirmed_;
};

}  // namespace grapnel
