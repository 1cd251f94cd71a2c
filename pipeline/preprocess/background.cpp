#include "pipeline/preprocess/background.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "pipeline/kernels/label_rows.h"

namespace grapnel {

FieldTable background_fields() noexcept {
  static constexpr std::array<std::string_view, 5> kMethods = {"off", "auto", "image", "plane",
                                                               "dominant"};
  static constexpr std::array kFields = {
      choice_field<&BackgroundParams::method>("method", kMethods,
                                              "taught image, taught plane, the frame's dominant "
                                              "planes, or the first of these there is"),
      number_field<&BackgroundParams::sigmas>("sigmas", "", 0.0, 20.0,
                                              "depth noise to stand above the background"),
      number_field<&BackgroundParams::sigma_1m_m>("sigma_1m_m", "m", 0.0, 0.1,
                                                  "axial noise at 1 m, 1 sigma; grows with z²"),
      number_field<&BackgroundParams::min_height_m>(
          "min_height_m", "m", 0.0, 10.0,
          "height above the background; 0 = min_height_ratio of its distance"),
      number_field<&BackgroundParams::min_height_ratio>(
          "min_height_ratio", "", 0.0, 0.5, "height above the background over its distance"),
      number_field<&BackgroundParams::max_planes>("max_planes", "", 1, 4,
                                                  "dominant planes removed, largest first"),
  };
  return kFields;
}

namespace {

/// Of a row whose labels are kNoLabel and kForeground, eight bytes at a time.
std::size_t labelled_of_row(const std::uint8_t* row, std::size_t width) noexcept {
  static_assert(kNoLabel == 0 && kForeground == 0xff);
  constexpr std::uint64_t kOnes = 0x0101010101010101;
  constexpr std::size_t kMost = 255;  // that a byte can count
  std::size_t count = 0;
  std::size_t u = 0;
  while (u + 8 <= width) {
    std::uint64_t sums = 0;
    for (std::size_t k = 0; k < kMost && u + 8 <= width; ++k, u += 8) {
      sums += eight_labels(row + u) & kOnes;
    }
    for (; sums != 0; sums >>= 8) count += sums & 0xff;
  }
  for (; u < width; ++u) count += row[u] & 1U;
  return count;
}

std::size_t labelled(const WorkingDepth& work) noexcept {
  std::size_t count = 0;
  for (int v = 0; v < work.label.height; ++v) {
    count += labelled_of_row(work.label.row(v), static_cast<std::size_t>(work.label.width));
  }
  return count;
}

/// Parallel to the ground and nearer to the camera: the tops of what stands on it.
bool lies_upon(const DepthPlane& plane, const DepthPlane& ground) noexcept {
  constexpr double kParallel = 0.98;  // 11 degrees
  return plane.normal.dot(ground.normal) > kParallel && plane.offset_m < ground.offset_m;
}

bool covers(const BeltBackground& belt, const WorkingDepth& work) noexcept {
  return !belt.depth.empty() && belt.depth.width >= work.left + work.depth.width &&
         belt.depth.height >= work.top + work.depth.height;
}

}  // namespace

void BackgroundRemoval::reserve(Arena& arena, const Limits& limits) {
  search_.reserve(arena);
  all_.reserve(arena, limits);
}

void BackgroundRemoval::remove_image(WorkingDepth& work, const BeltBackground& belt,
                                     const RowBands& bands) const noexcept {
  const auto unit = static_cast<float>(work.metres_per_unit);
  const auto noise = static_cast<float>(params_.sigmas * params_.sigma_1m_m);
  const auto height = static_cast<float>(params_.min_height_m);
  const auto ratio =
      params_.min_height_m > 0.0 ? 0.0F : static_cast<float>(params_.min_height_ratio);
  for (int v = 0; v < work.depth.height; ++v) {
    const std::uint16_t* empty = belt.depth.row(work.top + v) + work.left;
    const std::uint16_t* depth = work.depth.row(v);
    std::uint8_t* label = work.label.row(v);
    const RowBands::Columns columns = bands.at(v);
    for (int u = columns.begin; u < columns.end; ++u) {
      const float belt_m = static_cast<float>(empty[u]) * unit;
      const float depth_m = static_cast<float>(depth[u]) * unit;
      const float needed = std::max(noise * belt_m * belt_m, std::max(height, ratio * belt_m));
      // Where the belt itself gave no reading, any reading is something else.
      const bool above = empty[u] == 0 || belt_m - depth_m > needed;
      label[u] = above ? label[u] : kNoLabel;
    }
  }
}

void BackgroundRemoval::remove_plane(WorkingDepth& work, const DepthPlane& plane,
                                     const RowBands& bands) const noexcept {
  kernels::PlaneRow row;
  row.metres_per_unit = static_cast<float>(work.metres_per_unit);
  row.a = static_cast<float>(plane.a);
  row.offset_m = static_cast<float>(plane.offset_m);
  kernels::HeightLaw law;
  law.noise = static_cast<float>(params_.sigmas * params_.sigma_1m_m);
  law.height_m = static_cast<float>(params_.min_height_m);
  law.ratio = params_.min_height_m > 0.0 ? 0.0F : static_cast<float>(params_.min_height_ratio);
  for (int v = 0; v < work.depth.height; ++v) {
    const RowBands::Columns columns = bands.at(v);
    row.start = static_cast<float>(plane.a * columns.begin + plane.b * v + plane.c);
    kernels::keep_above_plane(work.depth.row(v) + columns.begin,
                              static_cast<std::size_t>(columns.width()), row, law,
                              work.label.row(v) + columns.begin);
  }
}

BackgroundReport BackgroundRemoval::apply(WorkingDepth& work, const BeltBackground& belt,
                                          double min_extent_m, Rng& rng) noexcept {
  BackgroundReport report;
  all_.cover(work);
  const std::size_t before = labelled(work);
  BackgroundMethod method = params_.method;
  if (method == BackgroundMethod::Auto) {
    method = covers(belt, work) ? BackgroundMethod::Image
             : belt.has_plane   ? BackgroundMethod::Plane
                                : BackgroundMethod::Dominant;
  }
  if (method == BackgroundMethod::Image && covers(belt, work)) {
    remove_image(work, belt, all_);
    if (belt.has_plane) {
      report.planes[report.plane_count++] =
          depth_plane(belt.plane_normal, belt.plane_offset_m, work.intrinsics);
    }
    report.used = method;
  } else if (method == BackgroundMethod::Plane && belt.has_plane) {
    report.planes[report.plane_count++] =
        depth_plane(belt.plane_normal, belt.plane_offset_m, work.intrinsics);
    remove_plane(work, report.planes[0], all_);
    report.used = method;
  } else if (method == BackgroundMethod::Dominant) {
    const auto wanted = static_cast<std::size_t>(params_.max_planes);
    DepthPlane plane;
    double share_left = 1.0;
    while (report.plane_count < std::min(wanted, report.planes.size()) &&
           search_.find(work, share_left, min_extent_m, rng, plane)) {
      if (report.plane_count > 0 && lies_upon(plane, report.planes[0])) break;
      report.planes[report.plane_count++] = plane;
      remove_plane(work, plane, all_);
      share_left = static_cast<double>(labelled(work)) / static_cast<double>(before);
      report.used = method;
    }
  }
  report.foreground = labelled(work);
  report.removed = before - report.foreground;
  return report;
}

void BackgroundRemoval::apply_again(WorkingDepth& work, const BeltBackground& belt,
                                    const RowBands& bands,
                                    BackgroundReport& report) const noexcept {
  if (report.used == BackgroundMethod::Off) return;
  for (int v = 0; v < work.depth.height; ++v) {
    const RowBands::Columns columns = bands.at(v);
    const std::uint16_t* depth = work.depth.row(v);
    std::uint8_t* label = work.label.row(v);
    for (int u = columns.begin; u < columns.end; ++u) {
      label[u] = depth[u] != 0 ? kForeground : kNoLabel;
    }
  }
  if (report.used == BackgroundMethod::Image) {
    remove_image(work, belt, bands);
  } else {
    for (std::size_t i = 0; i < report.plane_count; ++i) {
      remove_plane(work, report.planes[i], bands);
    }
  }
  const std::size_t before = report.foreground + report.removed;
  report.foreground = labelled(work);
  report.removed = before - report.foreground;
}

}  // namespace grapnel
