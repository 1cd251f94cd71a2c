#include "base/insertion_sort.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "base/rng.h"

namespace grapnel {
namespace {

TEST(InsertionSort, OrdersLikeTheStandardStableSort) {
  Rng rng(1);
  for (int length = 0; length < 40; ++length) {
    std::vector<std::pair<int, int>> ours;
    for (int i = 0; i < length; ++i) ours.emplace_back(static_cast<int>(rng.below(6)), i);
    std::vector<std::pair<int, int>> theirs = ours;
    const auto by_first = [](const auto& a, const auto& b) { return a.first < b.first; };
    insertion_sort(ours.begin(), ours.end(), by_first);
    std::stable_sort(theirs.begin(), theirs.end(), by_first);
    EXPECT_EQ(ours, theirs);
  }
}

}  // namespace
}  // namespace grapnel
