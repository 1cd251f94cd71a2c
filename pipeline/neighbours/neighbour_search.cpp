#include "pipeline/neighbours/neighbour_search.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace grapnel {

namespace {

constexpr std::size_t kRangesAtOnce = 64;
constexpr std::size_t kAskedBeside = 8;

double diagonal_m(const Surface& surface) noexcept {
  double squared = 0.0;
  for (const std::span<float>& plane : {surface.x, surface.y, surface.z}) {
    const auto [low, high] = std::minmax_element(
        plane.begin(), plane.begin() + static_cast<std::ptrdiff_t>(surface.size));
    const double extent = static_cast<double>(*high) - static_cast<double>(*low);
    squared += extent * extent;
  }
  return std::sqrt(squared);
}

}  // namespace

void NeighbourSearch::reserve(Arena& arena, std::size_t max_points, std::size_t max_grid_pixels) {
  window_.reserve(arena, max_grid_pixels);
  cells_.reserve(arena, max_points);
  for (std::span<float>* plane : {&x_, &y_, &z_, &squared_m2_}) {
    *plane = arena.take<float>(max_points + kernels::kSlack);
  }
  index_ = arena.take<std::int32_t>(max_points + kernels::kSlack);
  by_distance_ = arena.take<std::uint64_t>(max_points);
}

void NeighbourSearch::reserve(Arena& arena, const Limits& limits) {
  reserve(arena, std::max(limits.max_points, limits.max_model_points),
          static_cast<std::size_t>(limits.max_width) * static_cast<std::size_t>(limits.max_height));
}

Status NeighbourSearch::build(const Surface& surface, double radius_m) noexcept {
  surface_ = nullptr;
  if (surface.size == 0) return Error{Code::TooFewPoints, Stage::None, 0};
  if (surface.size > by_distance_.size()) {
    return Error{Code::CapacityExceeded, Stage::None, static_cast<std::int32_t>(surface.size)};
  }
  if (!surface.all_finite()) return Error{Code::BadParameter, Stage::None, 0};
  surface_ = &surface;
  typical_radius_m_ = static_cast<float>(radius_m);
  reach_m_ = static_cast<float>(diagonal_m(surface) * 1.0001);
  on_grid_ = window_.build(surface);
  if (!on_grid_) cells_.build(surface, radius_m);
  copy_points(surface);
  return {};
}

void NeighbourSearch::copy_points(const Surface& surface) noexcept {
  const std::array<std::span<float>, 3> from = {surface.x, surface.y, surface.z};
  const std::array<std::span<float>, 3> to = {x_, y_, z_};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (on_grid_) {
      std::copy_n(from[axis].begin(), surface.size, to[axis].begin());
      continue;
    }
    for (std::size_t i = 0; i < surface.size; ++i) {
      to[axis][i] = from[axis][static_cast<std::size_t>(cells_.order()[i])];
    }
  }
}

namespace {

/// Hands on ranges in batches.
template <class Use>
class Batches {
 public:
  explicit Batches(const Use& use) noexcept : use_(use) {}
  void add(PointRange range) noexcept {
    if (range.begin == range.end) return;
    ranges_[pending_++] = range;
    if (pending_ == kRangesAtOnce) flush();
  }
  void flush() noexcept {
    if (pending_ > 0) use_(std::span<const PointRange>(ranges_).first(pending_));
    pending_ = 0;
  }

 private:
  const Use& use_;
  std::array<PointRange, kRangesAtOnce> ranges_;
  std::size_t pending_ = 0;
};

}  // namespace

template <class Use>
void NeighbourSearch::for_ranges(const Corners& corners, float radius_m,
                                 const Use& use) const noexcept {
  if (!on_grid_) {
    for_rows(cells_.box(corners.low, corners.high, radius_m), use);
    return;
  }
  Batches batches(use);
  const WindowIndex::Window window = window_.window(corners.low, corners.high, radius_m);
  for (int row = window.top; row <= window.bottom; ++row) batches.add(window_.stretch(window, row));
  batches.flush();
}

template <class Use>
void NeighbourSearch::for_rows(const CellIndex::Box& box, const Use& use) const noexcept {
  Batches batches(use);
  for (int cell_z = box.low[2]; cell_z <= box.high[2]; ++cell_z) {
    for (int cell_y = box.low[1]; cell_y <= box.high[1]; ++cell_y) {
      batches.add(cells_.stretch(box, cell_y, cell_z));
    }
  }
  batches.flush();
}

std::size_t NeighbourSearch::select(const Vec3f& place, float radius_m) noexcept {
  GRAPNEL_ASSERT(surface_ != nullptr);
  const kernels::Sphere sphere{place.x(), place.y(), place.z(), radius_m * radius_m};
  const kernels::PointPlanes points{x_.data(), y_.data(), z_.data()};
  std::size_t found = 0;
  for_ranges({place, place}, radius_m, [&](std::span<const PointRange> ranges) {
    found += kernels::select_within(points, ranges, sphere, index_.data() + found,
                                    squared_m2_.data() + found);
  });
  return found;
}

Neighbourhood NeighbourSearch::near_position(std::size_t position, float radius_m) noexcept {
  const std::size_t found = select(Vec3f(x_[position], y_[position], z_[position]), radius_m);
  return {index_.first(found), squared_m2_.first(found)};
}

Neighbourhood NeighbourSearch::within(const Vec3f& place, float radius_m) noexcept {
  const std::size_t found = select(place, radius_m);
  if (!on_grid_) {
    for (std::size_t i = 0; i < found; ++i) index_[i] = cells_.point(index_[i]);
  }
  return {index_.first(found), squared_m2_.first(found)};
}

kernels::SphereMoments NeighbourSearch::moments(std::size_t point_i,
                                                float radius_m) const noexcept {
  GRAPNEL_ASSERT(surface_ != nullptr && point_i < surface_->size);
  const Vec3f place = surface_->point(point_i);
  const kernels::Sphere sphere{place.x(), place.y(), place.z(), radius_m * radius_m};
  const kernels::PointPlanes points{x_.data(), y_.data(), z_.data()};
  kernels::PartialMoments partial{};
  for_ranges({place, place}, radius_m, [&](std::span<const PointRange> ranges) {
    kernels::add_sphere_moments(points, ranges, sphere, partial);
  });
  return kernels::fold(partial);
}

kernels::BlockOfPoints NeighbourSearch::block_from(std::size_t position,
                                                   float radius_m) const noexcept {
  GRAPNEL_ASSERT(surface_ != nullptr && position < surface_->size);
  const std::size_t most =
      std::min(surface_->size - position, static_cast<std::size_t>(kernels::kBlock));
  std::size_t count = 1;
  for (; count < most; ++count) {
    const std::size_t i = position + count;
    if (!(std::fabs(x_[i] - x_[position]) <= radius_m &&
          std::fabs(y_[i] - y_[position]) <= radius_m &&
          std::fabs(z_[i] - z_[position]) <= radius_m)) {
      break;
    }
  }
  return {static_cast<std::int32_t>(position), static_cast<std::int32_t>(count)};
}

NeighbourSearch::Corners NeighbourSearch::corners(
    const kernels::BlockOfPoints& block) const noexcept {
  const auto first = static_cast<std::size_t>(block.first);
  Corners around{Vec3f(x_[first], y_[first], z_[first]), Vec3f(x_[first], y_[first], z_[first])};
  for (std::size_t i = first + 1; i < first + static_cast<std::size_t>(block.count); ++i) {
    const Vec3f p(x_[i], y_[i], z_[i]);
    around.low = around.low.cwiseMin(p);
    around.high = around.high.cwiseMax(p);
  }
  return around;
}

bool NeighbourSearch::near_block(const kernels::BlockOfPoints& block, float radius_m,
                                 kernels::NearBlock& near) const noexcept {
  GRAPNEL_ASSERT(surface_ != nullptr);
  near.size = 0;
  near.of.fill(0);
  const kernels::PointPlanes points{x_.data(), y_.data(), z_.data()};
  bool fits = true;
  for_ranges(corners(block), radius_m, [&](std::span<const PointRange> ranges) {
    fits = fits && kernels::add_near_block(points, block, ranges, radius_m * radius_m, near);
  });
  return fits;
}

void NeighbourSearch::block_moments(const kernels::BlockOfPoints& block, float radius_m,
                                    float (*sums)[kernels::kBlock]) const noexcept {
  GRAPNEL_ASSERT(surface_ != nullptr && !on_grid_);
  const Corners around = corners(block);
  const kernels::PointPlanes points{x_.data(), y_.data(), z_.data()};
  std::fill_n(&sums[0][0], kernels::kWindowSums * kernels::kBlock, 0.0F);
  for_rows(cells_.box(around.low, around.high, radius_m), [&](std::span<const PointRange> ranges) {
    float part[kernels::kWindowSums][kernels::kBlock];
    kernels::block_scatter(points, block, ranges, radius_m * radius_m, true, part);
    for (int k = 0; k < kernels::kWindowSums; ++k) {
      for (int lane = 0; lane < kernels::kBlock; ++lane) sums[k][lane] += part[k][lane];
    }
  });
}

bool NeighbourSearch::exceeded(std::size_t position, float radius_m,
                               const float* values) const noexcept {
  GRAPNEL_ASSERT(surface_ != nullptr && position < surface_->size);
  const Vec3f place(x_[position], y_[position], z_[position]);
  const float squared = radius_m * radius_m;
  const float own = values[position];
  const auto decides = [&](std::size_t i) {
    return values[i] > own && (Vec3f(x_[i], y_[i], z_[i]) - place).squaredNorm() <= squared;
  };
  // The points before and behind mostly lie near, and mostly one of them decides.
  for (std::size_t step = 1; step <= kAskedBeside; ++step) {
    if (position >= step && decides(position - step)) return true;
    if (position + step < surface_->size && decides(position + step)) return true;
  }
  const kernels::Sphere sphere{place.x(), place.y(), place.z(), squared};
  const kernels::PointPlanes points{x_.data(), y_.data(), z_.data()};
  bool found = false;
  for_ranges({place, place}, radius_m, [&](std::span<const PointRange> ranges) {
    found = found || kernels::exceeded_within(points, values, ranges, sphere, own);
  });
  return found;
}

Neighbourhood NeighbourSearch::within(std::size_t point_i, float radius_m) noexcept {
  GRAPNEL_ASSERT(surface_ != nullptr && point_i < surface_->size);
  return within(surface_->point(point_i), radius_m);
}

Neighbourhood NeighbourSearch::nearest(const Vec3f& place, std::size_t count) noexcept {
  GRAPNEL_ASSERT(surface_ != nullptr);
  count = std::min(count, surface_->size);
  const Vec3f first = surface_->point(0);
  // Every point lies within the box's diagonal of the first one, so within this of the place.
  const float farthest = ((place - first).norm() + reach_m_) * 1.0001F + 1e-30F;
  float radius = std::min(typical_radius_m_, farthest);
  Neighbourhood found = within(place, radius);
  while (found.size() < count && radius < farthest) {
    radius = std::min(1.6F * radius, farthest);
    found = within(place, radius);
  }
  count = std::min(count, found.size());
  // A positive float's bits order like the float.
  for (std::size_t i = 0; i < found.size(); ++i) {
    by_distance_[i] =
        (static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(squared_m2_[i])) << 32) |
        static_cast<std::uint32_t>(index_[i]);
  }
  const auto begin = by_distance_.begin();
  const auto middle = begin + static_cast<std::ptrdiff_t>(count);
  std::nth_element(begin, middle, begin + static_cast<std::ptrdiff_t>(found.size()));
  std::sort(begin, middle);
  for (std::size_t i = 0; i < count; ++i) {
    index_[i] = static_cast<std::int32_t>(by_distance_[i] & 0xffffffffU);
    squared_m2_[i] = std::bit_cast<float>(static_cast<std::uint32_t>(by_distance_[i] >> 32));
  }
  return {index_.first(count), squared_m2_.first(count)};
}

Neighbourhood NeighbourSearch::thin(Neighbourhood found, std::size_t count) noexcept {
  GRAPNEL_ASSERT(found.index.data() == index_.data());
  if (found.size() <= count) return found;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t from = i * found.size() / count;
    index_[i] = index_[from];
    squared_m2_[i] = squared_m2_[from];
  }
  return {index_.first(count), squared_m2_.first(count)};
}

Symmetric3 scatter(const kernels::SphereMoments& m) noexcept {
  const auto wide = [](float value) { return static_cast<double>(value); };
  return {wide(m.xx), wide(m.xy), wide(m.xz), wide(m.yy), wide(m.yz), wide(m.zz)};
}

Symmetric3 covariance(const kernels::SphereMoments& m) noexcept {
  const double inverse = 1.0 / static_cast<double>(m.count);
  const double x = static_cast<double>(m.x) * inverse;
  const double y = static_cast<double>(m.y) * inverse;
  const double z = static_cast<double>(m.z) * inverse;
  const Symmetric3 s = scatter(m);
  return {s.xx * inverse - x * x, s.xy * inverse - x * y, s.xz * inverse - x * z,
          s.yy * inverse - y * y, s.yz * inverse - y * z, s.zz * inverse - z * z};
}

double mean_spacing_m(NeighbourSearch& search, const Surface& surface,
                      std::size_t samples) noexcept {
  if (surface.size < 2 || samples == 0) return 0.0;
  const std::size_t step = (surface.size + samples - 1) / samples;
  double sum = 0.0;
  std::size_t counted = 0;
  for (std::size_t i = 0; i < surface.size; i += step) {
    const Neighbourhood nearest = search.nearest(surface.point(i), 2);
    sum += std::sqrt(static_cast<double>(nearest.squared_m2[1]));
    ++counted;
  }
  return sum / static_cast<double>(counted);
}

}  // namespace grapnel
