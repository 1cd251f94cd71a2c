#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "pipeline/kernels/moved.h"

namespace grapnel::kernels {

/// Largest half-width of a window, in pixels.
inline constexpr int kMaxWindowReach = 5;
inline constexpr std::size_t kMaxWindowPoints = 120;

/// The pixels of a window around its centre, and the exchanges that bring the `nearest` smallest of
/// their distances to the front, sorted: Batcher's merge exchange (Knuth 1998, algorithm 5.2.2M)
/// without the exchanges that no such output depends on. Load time: takes memory from the heap.
class WindowSelection {
 public:
  /// `nearest` is at most the window's number of other pixels.
  WindowSelection(int reach, std::size_t nearest);

  struct Offset {
    int du = 0;
    int dv = 0;
  };
  struct Exchange {
    std::uint8_t low = 0;
    std::uint8_t high = 0;
  };
  [[nodiscard]] int reach() const noexcept { return reach_; }
  [[nodiscard]] std::size_t nearest() const noexcept { return nearest_; }
  [[nodiscard]] const std::vector<Offset>& offsets() const noexcept { return offsets_; }
  [[nodiscard]] const std::vector<Exchange>& exchanges() const noexcept { return exchanges_; }

 private:
  int reach_ = 0;
  std::size_t nearest_ = 0;
  std::vector<Offset> offsets_;
  std::vector<Exchange> exchanges_;
};

/// Organised points as dense planes; a pixel without a point lies very far away. Around each row
/// and behind the last are kMaxWindowReach such pixels, plus kLanes behind.
struct PixelPlanes {
  const float* x = nullptr;
  const float* y = nullptr;
  const float* z = nullptr;
  std::ptrdiff_t stride = 0;  ///< elements from row to row
};

/// For the kLanes pixels from `first`: sum of the distances to the nearest of the window's other
/// points, and the largest of them squared.
void nearest_in_window(const PixelPlanes& planes, std::ptrdiff_t first,
                       const WindowSelection& selection, float* sum_m, float* farthest_m2) noexcept;

}  // namespace grapnel::kernels
