#include "pipeline/neighbours/cell_order.h"

#include <algorithm>
#include <array>

namespace grapnel {
namespace {

constexpr double kMaxCells = 68719476736.0;  // 2^36
// Above it a float has no unit digit any more, and an int still holds it.
constexpr float kLargestPlace = 16777216.0F;
constexpr unsigned kWordBits = 6;

/// Floor of a value within ±kLargestPlace: the library's is a call where SSE4.1 is not assumed.
std::int32_t floor_of(float value) noexcept {
  const auto whole = static_cast<std::int32_t>(value);
  return whole - (static_cast<float>(whole) > value ? 1 : 0);
}

/// How many bits are set: std::popcount is a call where SSE4.2 is not assumed.
std::uint32_t bits_in(std::uint64_t word) noexcept {
  word -= word >> 1 & 0x5555555555555555U;
  word = (word & 0x3333333333333333U) + (word >> 2 & 0x3333333333333333U);
  word = (word + (word >> 4)) & 0x0F0F0F0F0F0F0F0FU;
  return static_cast<std::uint32_t>(word * 0x0101010101010101U >> 56);
}

/// Cells along an axis.
struct CellAxis {
  std::span<const float> plane;
  std::int32_t first = 0;
  std::uint32_t count = 0;
};

std::uint64_t cell_along(const CellAxis& axis, float inverse, std::size_t i) noexcept {
  return static_cast<std::uint32_t>(floor_of(axis.plane[i] * inverse) - axis.first);
}

/// Linear cell of each point.
void fill_keys(const std::array<CellAxis, 3>& axes, float inverse,
               std::span<std::uint64_t> key) noexcept {
  const auto [x, y, z] = axes;
  for (std::size_t i = 0; i < key.size(); ++i) {
    const std::uint64_t row = cell_along(z, inverse, i) * y.count + cell_along(y, inverse, i);
    key[i] = row * x.count + cell_along(x, inverse, i);
  }
}

}  // namespace

Extent extent_of(std::span<const float> values) noexcept {
  // Lanes that the compiler makes vectors of: one running minimum waits for itself.
  constexpr std::size_t kLanes = 8;
  std::array<float, kLanes> low;
  std::array<float, kLanes> high;
  low.fill(values[0]);
  high.fill(values[0]);
  for (std::size_t i = 0; i < values.size(); i += kLanes) {
    const std::size_t lanes = std::min(kLanes, values.size() - i);
    for (std::size_t k = 0; k < lanes; ++k) {
      low[k] = values[i + k] < low[k] ? values[i + k] : low[k];
      high[k] = values[i + k] > high[k] ? values[i + k] : high[k];
    }
  }
  return {*std::min_element(low.begin(), low.end()), *std::max_element(high.begin(), high.end())};
}

void CellOrder::reserve(Arena& arena, std::size_t max_points) {
  key_ = arena.take<std::uint64_t>(max_points);
  word_ = arena.take<std::uint64_t>(max_points);
  before_ = arena.take<std::uint32_t>(max_points);
  cell_of_ = arena.take<std::uint32_t>(max_points);
}

bool CellOrder::number(const Surface& surface, double edge_m) noexcept {
  GRAPNEL_ASSERT(surface.size <= key_.size());
  size_ = surface.size;
  cells_ = 0;
  if (size_ == 0) return true;
  std::array<CellAxis, 3> axes = {
      {{surface.x.first(size_)}, {surface.y.first(size_)}, {surface.z.first(size_)}}};
  // In float, as PCL: the cell of a point on a border depends on it.
  const auto inverse = static_cast<float>(1.0 / edge_m);
  double cells = 1.0;
  for (CellAxis& axis : axes) {
    const auto [low, high] = extent_of(axis.plane);
    if (!(low * inverse > -kLargestPlace && high * inverse < kLargestPlace)) return false;
    axis.first = floor_of(low * inverse);
    axis.count = static_cast<std::uint32_t>(floor_of(high * inverse) - axis.first) + 1;
    cells *= axis.count;
  }
  if (!(cells < kMaxCells)) return false;
  fill_keys(axes, inverse, key_.first(size_));
  const std::uint64_t last = static_cast<std::uint64_t>(cells) - 1;
  unsigned shift = kWordBits;
  while (last >> shift >= size_) shift += kWordBits;
  for (std::size_t i = 0; i < size_; ++i)
    cell_of_[i] = static_cast<std::uint32_t>(key_[i] >> shift);
  cells_ = static_cast<std::size_t>(last >> shift) + 1;
  while (shift > 0) {
    shift -= kWordBits;
    cells_ = look_into(cells_, shift);
  }
  return true;
}

/// From words to the occupied ones of their 64 parts: how many there are.
std::size_t CellOrder::look_into(std::size_t words, unsigned shift) noexcept {
  // Spans of its own: what is written here might else be the members' sizes.
  const std::span<const std::uint64_t> key = key_.first(size_);
  const std::span<std::uint64_t> word = word_.first(words);
  const std::span<std::uint32_t> before = before_;
  const std::span<std::uint32_t> cell_of = cell_of_;
  const auto bit = [&](std::size_t i) { return std::uint64_t{1} << (key[i] >> shift & 63U); };
  std::fill(word.begin(), word.end(), 0U);
  for (std::size_t i = 0; i < key.size(); ++i) word[cell_of[i]] |= bit(i);
  std::uint32_t set = 0;
  for (std::size_t w = 0; w < words; ++w) {
    before[w] = set;
    set += bits_in(word[w]);
  }
  for (std::size_t i = 0; i < key.size(); ++i) {
    const std::uint32_t w = cell_of[i];
    cell_of[i] = before[w] + bits_in(word[w] & (bit(i) - 1));
  }
  return set;
}

bool CellOrder::sort(const Surface& surface, double edge_m) noexcept {
  if (!number(surface, edge_m)) return false;
  std::fill_n(before_.begin(), cells_, 0U);
  for (std::size_t i = 0; i < size_; ++i) ++before_[cell_of_[i]];
  std::uint32_t sum = 0;
  for (std::uint32_t& entry : before_.first(cells_)) {
    const std::uint32_t here = entry;
    entry = sum;
    sum += here;
  }
  // Each cell's begin moves to its end.
  for (std::size_t i = 0; i < size_; ++i) key_[before_[cell_of_[i]]++] = i;
  return true;
}

}  // namespace grapnel
