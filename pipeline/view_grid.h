#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "base/arena.h"
#include "pipeline/kernels/window_planes.h"
#include "pipeline/limits.h"
#include "pipeline/surface.h"

namespace grapnel {

/// A camera's view as means of blocks of pixels, spread out on their grid: what is thinned next
/// anyway gets its normals from windows of pixels sooner than from neighbours that must be found.
class ViewGrid {
 public:
  /// Pixels that a block has at most both ways.
  static constexpr int kMaxStride = 4;

  /// For views of up to the limits' width and height.
  void reserve(Arena& arena, const Limits& limits);

  /// Fills `to` with the mean of each block of `stride` by `stride` pixels, row by row: of the
  /// readings within `same_m` of its first one's depth. Behind the means come the other readings
  /// as they are. With `attributes` normals and intensities are averaged too, else they are
  /// zero. False when `to` or the grid has no room. O(pixels).
  [[nodiscard]] bool take(const Surface& view, int stride, double same_m, bool attributes,
                          Surface& to) noexcept;

  /// Normals of the means, which `to` holds as take() left them: the planes that fit their
  /// windows' inverse depths best, where no step is near; else those of the means in a sphere.
  /// Either reaches `radius_m`, at the distance `at_m` from the camera, but two to kReach blocks.
  /// They face as those that `to` had, where it had some, else the viewpoint. All zero where fewer
  /// than five means are near, or all on a line. False, and nothing done, where the view's points
  /// do not project to their pixels. O(blocks × window's edge), at steps × window.
  [[nodiscard]] bool normals(double radius_m, double at_m, Surface& to) const noexcept;

 private:
  static constexpr int kReach = kernels::kMaxPlaneReach;

  /// Pixels of a row from the first to the last with a reading.
  struct Span {
    int first = std::numeric_limits<int>::max();
    int last = -1;
  };
  struct Cut;
  struct Batch;
  struct StripNormals;

  [[nodiscard]] bool fit(const Surface& view, int stride) noexcept;
  /// The block whose first pixel is (u, v) as element `at`. False when `to` has no room.
  [[nodiscard]] bool take_block(Cut& cut, int u, int v, std::size_t at, Surface& to) noexcept;
  [[nodiscard]] bool projects(const Surface& view) const noexcept;
  /// First element of a row of blocks.
  [[nodiscard]] std::size_t row(int down) const noexcept {
    return static_cast<std::size_t>((down + kReach) * row_ + kReach);
  }
  void fit_strip(int across, double radius_m, int reach, Batch& batch, Surface& to) const noexcept;
  /// Normals of a row of a strip where its windows found some; the others' covariances.
  void settle_row(const StripNormals& found, std::size_t at, double radius_m, Batch& batch,
                  Surface& to) const noexcept;
  void add_spheres(std::size_t at, std::uint32_t lanes, double radius_m,
                   Batch& batch) const noexcept;

  std::array<std::span<float>, 3> place_;  ///< coordinates; kNowhere where a block is empty
  std::span<float> inverse_m_;             ///< 1/z, 0 where a block is empty
  std::span<std::int32_t> point_;          ///< of the thinned view; -1
  std::span<Span> spans_;                  ///< of each row of the view
  std::array<int, 2> first_px_{};          ///< of the view that belongs to a block, u and v
  std::array<int, 2> blocks_{};            ///< across and down
  std::ptrdiff_t row_ = 0;                 ///< elements from row to row
  Intrinsics camera_;                      ///< of the blocks
  bool projects_ = false;
};

}  // namespace grapnel
