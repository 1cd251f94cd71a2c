#include "pipeline/neighbours/cell_order.h"

#include <algorithm>
#include <array>

namespace grapnel {
namespace {

constexpr double kMaxCells = 68719476736.0;  // 2^36
// Above it a float has no unit digit any more, and an int still holds it.
constexpr float kLargestPlace = 16777216.0F;
constexpr unsigned kDigitBits = 11;
constexpr std::size_t kDigits = std::size_t{1} << kDigitBits;
constexpr std::size_t kMaxPasses = 4;

/// Floor of a value within ±kLargestPlace: the library's is a call where SSE4.1 is not assumed.
std::int32_t floor_of(float value) noexcept {
  const auto whole = static_cast<std::int32_t>(value);
  return whole - (static_cast<float>(whole) > value ? 1 : 0);
}

}  // namespace

void CellOrder::reserve(Arena& arena, std::size_t max_points) {
  GRAPNEL_ASSERT(max_points <= kIndexMask);
  entry_ = arena.take<std::uint64_t>(max_points);
  other_ = arena.take<std::uint64_t>(max_points);
}

bool CellOrder::sort(const Surface& surface, double edge_m) noexcept {
  GRAPNEL_ASSERT(surface.size <= entry_.size());
  size_ = surface.size;
  if (size_ == 0) return true;
  const std::array<std::span<float>, 3> planes = {surface.x, surface.y, surface.z};
  // In float, as PCL: the cell of a point on a border depends on it.
  const auto inverse = static_cast<float>(1.0 / edge_m);
  std::array<std::int32_t, 3> first{};
  std::array<double, 3> count{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float low = planes[axis][0];
    float high = low;
    for (const float value : planes[axis].first(size_)) {
      low = value < low ? value : low;
      high = value > high ? value : high;
    }
    if (!(low * inverse > -kLargestPlace && high * inverse < kLargestPlace)) return false;
    first[axis] = floor_of(low * inverse);
    count[axis] = static_cast<double>(floor_of(high * inverse) - first[axis]) + 1.0;
  }
  if (!(count[0] * count[1] * count[2] < kMaxCells)) return false;
  const auto row = static_cast<std::uint64_t>(count[0]);
  const std::uint64_t slice = row * static_cast<std::uint64_t>(count[1]);
  const auto cell = [&](std::size_t axis, std::size_t i) {
    return static_cast<std::uint64_t>(floor_of(planes[axis][i] * inverse) - first[axis]);
  };
  for (std::size_t i = 0; i < size_; ++i) {
    const std::uint64_t key = cell(2, i) * slice + cell(1, i) * row + cell(0, i);
    entry_[i] = key << kIndexBits | i;
  }
  radix_sort(static_cast<std::uint64_t>(count[2]) * slice - 1);
  return true;
}

void CellOrder::radix_sort(std::uint64_t largest_key) noexcept {
  std::size_t passes = 0;
  for (; passes < kMaxPasses && largest_key >> (kDigitBits * passes) != 0; ++passes) {
  }
  std::array<std::array<std::uint32_t, kDigits>, kMaxPasses> begin{};
  for (std::size_t i = 0; i < size_; ++i) {
    const std::uint64_t key = entry_[i] >> kIndexBits;
    for (std::size_t pass = 0; pass < passes; ++pass) {
      ++begin[pass][key >> (kDigitBits * pass) & (kDigits - 1)];
    }
  }
  for (std::size_t pass = 0; pass < passes; ++pass) {
    std::uint32_t sum = 0;
    for (std::uint32_t& entry : begin[pass]) {
      const std::uint32_t here = entry;
      entry = sum;
      sum += here;
    }
    for (std::size_t i = 0; i < size_; ++i) {
      const std::uint64_t key = entry_[i] >> kIndexBits;
      other_[begin[pass][key >> (kDigitBits * pass) & (kDigits - 1)]++] = entry_[i];
    }
    std::swap(entry_, other_);
  }
}

std::size_t CellOrder::occupied_cells() const noexcept {
  std::size_t cells = size_ > 0 ? 1 : 0;
  for (std::size_t i = 1; i < size_; ++i) cells += same_cell(i, i - 1) ? 0U : 1U;
  return cells;
}

}  // namespace grapnel
