#include "pipeline/neighbours/cell_order.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace grapnel {
namespace {

constexpr double kMaxCells = 68719476736.0;  // 2^36
constexpr unsigned kDigitBits = 11;
constexpr std::size_t kDigits = std::size_t{1} << kDigitBits;
constexpr std::size_t kMaxPasses = 4;

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
  std::array<float, 3> first{};
  std::array<double, 3> count{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float low = planes[axis][0];
    float high = low;
    for (const float value : planes[axis].first(size_)) {
      low = std::min(low, value);
      high = std::max(high, value);
    }
    first[axis] = std::floor(low * inverse);
    count[axis] =
        static_cast<double>(std::floor(high * inverse)) - static_cast<double>(first[axis]) + 1.0;
  }
  // Above 2^24 a float has no unit digit any more.
  for (const double cells : count) {
    if (!(cells < 16777216.0)) return false;
  }
  if (!(count[0] * count[1] * count[2] < kMaxCells)) return false;
  const auto row = static_cast<std::uint64_t>(count[0]);
  const std::uint64_t slice = row * static_cast<std::uint64_t>(count[1]);
  const auto cell = [&](std::size_t axis, std::size_t i) {
    const float place = std::floor(planes[axis][i] * inverse);
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(place) -
                                      static_cast<std::int64_t>(first[axis]));
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
