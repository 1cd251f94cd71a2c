#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/arena.h"
#include "base/cloud.h"
#include "base/depth_frame.h"
#include "base/rng.h"
#include "pipeline/limits.h"
#include "pipeline/surface.h"

namespace grapnel::test {

/// Runs a reserve function over a measuring and a carving arena and owns the memory.
class ArenaMemory {
 public:
  template <class Reserve>
  explicit ArenaMemory(const Reserve& reserve) {
    Arena measure;
    reserve(measure);
    const std::size_t bytes = measure.used_bytes() + Arena::kAlignment;
    memory_ = std::make_unique<std::byte[]>(bytes);
    void* first = memory_.get();
    std::size_t room = bytes;
    std::align(Arena::kAlignment, measure.used_bytes(), first, room);
    Arena carve({static_cast<std::byte*>(first), measure.used_bytes()});
    reserve(carve);
    measured_ = measure.used_bytes();
    used_ = carve.used_bytes();
  }
  [[nodiscard]] std::size_t measured_bytes() const { return measured_; }
  [[nodiscard]] std::size_t used_bytes() const { return used_; }

 private:
  std::unique_ptr<std::byte[]> memory_;
  std::size_t measured_ = 0;
  std::size_t used_ = 0;
};

/// A surface with memory of its own.
class OwnedSurface {
 public:
  OwnedSurface(std::size_t max_points, std::size_t max_grid_pixels)
      : memory_([&](Arena& arena) { surface_.reserve(arena, max_points, max_grid_pixels); }) {}
  Surface& operator*() { return surface_; }
  Surface* operator->() { return &surface_; }

 private:
  Surface surface_;
  ArenaMemory memory_;
};

/// Limits large enough for the tests' clouds and small enough to carve fast.
[[nodiscard]] Limits small_limits();

/// The cloud's points (those with a reading) and normals, without grid, seen from the origin.
[[nodiscard]] OwnedSurface surface_of(const CloudData& cloud);
/// The cloud's grid and points; pinhole intrinsics as given.
[[nodiscard]] OwnedSurface grid_surface_of(const CloudData& cloud, const Intrinsics& intrinsics);

/// Points uniform in a box of this edge.
[[nodiscard]] OwnedSurface random_cloud(std::size_t points, double edge_m, std::uint64_t seed);
/// A wavy sheet about 1 m before a camera of width × height pixels, with gaps, on its grid.
[[nodiscard]] OwnedSurface wavy_grid(int width, int height, std::uint64_t seed);
/// Points on a sphere (Fibonacci lattice), spacing set, normals outward when asked.
[[nodiscard]] OwnedSurface sphere(std::size_t points, double radius_m, bool with_normals);
/// A smooth bumpy closed surface with normals unset and spacing_m set.
[[nodiscard]] OwnedSurface bumpy_ball(std::size_t points, double radius_m);

/// Moves points and normals; the grid is dropped.
void move(Surface& surface, const Pose& pose);

/// Frame whose depths a test fills.
struct TestFrame {
  std::vector<std::uint16_t> counts;
  DepthFrame frame;
  TestFrame(int width, int height, double focal_px);
  std::uint16_t& at(int u, int v) {
    return counts[static_cast<std::size_t>(v) * static_cast<std::size_t>(frame.depth.width) +
                  static_cast<std::size_t>(u)];
  }
  /// Depth of n·p + offset = 0 into every pixel of a rectangle (right, bottom exclusive).
  void draw_plane(const Vec3d& normal, double offset_m, int left, int top, int right, int bottom);
};

}  // namespace grapnel::test
