#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/cloud.h"
#include "base/depth_frame.h"
#include "pipeline/surface.h"
#include "workbench/input.h"

namespace grapnel {

/// A surface with its memory.
class StoredSurface {
 public:
  StoredSurface(std::size_t max_points, std::size_t max_grid_pixels);
  Surface surface;
  std::vector<std::uint32_t> input_of;  ///< surface point → index in the cloud or pixel

 private:
  struct Free {
    void operator()(std::byte* block) const noexcept;
  };
  std::unique_ptr<std::byte[], Free> block_;
};

/// The intrinsics that an organised cloud was taken with, fitted to its points; invalid when its
/// points do not lie on the pixel rays of a pinhole camera. O(points).
[[nodiscard]] Intrinsics fit_intrinsics(const CloudData& cloud);

/// An input as the registrar takes surfaces: a frame or a camera's cloud with grid and viewpoint,
/// any other cloud as points; those have a viewpoint where the file names one (PCD VIEWPOINT) or
/// where all lie before a camera at the origin that looks along +z. Points without reading are left
/// out. O(points).
[[nodiscard]] std::unique_ptr<StoredSurface> make_surface(const Input& input);
[[nodiscard]] std::unique_ptr<StoredSurface> make_surface(const DepthFrame& frame);
[[nodiscard]] std::unique_ptr<StoredSurface> make_surface(const CloudData& cloud);

/// Distance between neighbouring samples, metres: of a grid the pixel pitch at the median depth, of
/// a cloud the mean distance to the nearest other point, over at most 200 points. 0 for fewer than
/// two points. O(points).
[[nodiscard]] double measured_spacing_m(const Surface& surface);

}  // namespace grapnel
