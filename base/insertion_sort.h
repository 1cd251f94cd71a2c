#pragma once

#include <utility>

namespace grapnel {

/// Sorts in place and keeps the order of equal elements, without heap memory (std::stable_sort
/// takes a buffer from it). For short lists: O(n²) moves at worst, O(n) when nearly sorted.
template <class Iterator, class Less>
void insertion_sort(Iterator first, Iterator last, Less less) {
  if (first == last) return;
  for (Iterator next = first + 1; next != last; ++next) {
    auto value = std::move(*next);
    Iterator hole = next;
    for (; hole != first && less(value, *(hole - 1)); --hole) *hole = std::move(*(hole - 1));
    *hole = std::move(value);
  }
}

}  // namespace grapnel
