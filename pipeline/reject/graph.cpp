#include "pipeline/reject/graph.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <string_view>

#include "pipeline/kernels/rigid_pairs.h"

namespace grapnel {
namespace {

/// Cliques that share more than half of the smaller one are one.
constexpr std::size_t kDistinct = 2;

std::size_t bits_of(std::span<const std::uint64_t> a) noexcept {
  std::size_t count = 0;
  for (const std::uint64_t word : a) count += static_cast<std::size_t>(std::popcount(word));
  return count;
}

std::size_t bits_of_both(std::span<const std::uint64_t> a,
                         std::span<const std::uint64_t> b) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    count += static_cast<std::size_t>(std::popcount(a[i] & b[i]));
  }
  return count;
}

bool has(std::span<const std::uint64_t> bits, std::size_t i) noexcept {
  return (bits[i / 64] >> (i % 64) & 1U) != 0;
}
void set(std::span<std::uint64_t> bits, std::size_t i) noexcept {
  bits[i / 64] |= std::uint64_t{1} << (i % 64);
}
void clear(std::span<std::uint64_t> bits, std::size_t i) noexcept {
  bits[i / 64] &= ~(std::uint64_t{1} << (i % 64));
}

template <class Use>
void for_each_bit(std::span<const std::uint64_t> bits, const Use& use) {
  for (std::size_t word = 0; word < bits.size(); ++word) {
    for (std::uint64_t rest = bits[word]; rest != 0; rest &= rest - 1) {
      use(word * 64 + static_cast<std::size_t>(std::countr_zero(rest)));
    }
  }
}

}  // namespace

FieldTable graph_rejector_fields() noexcept {
  using P = GraphRejectorParams;
  static constexpr std::array<std::string_view, 2> kKeep = {"cliques", "core"};
  static constexpr std::array kFields = {
      choice_field<&P::keep>("keep", kKeep, "the largest cliques, or the densest core"),
      number_field<&P::tolerance_m>("tolerance_m", "m", 0.0, 10.0,
                                    "of lengths between pairs; 0 = 1.5 × the target's spacing"),
      number_field<&P::normal_tolerance>("normal_tolerance", "", 0.0, 2.0,
                                         "of cosines between normals; 2 = any"),
      number_field<&P::max_pairs>("max_pairs", "", 3, 8192,
                                  "the nearest that take part; the others are dropped"),
      number_field<&P::seeds>("seeds", "", 1, 4096, "pairs that cliques are grown from"),
      number_field<&P::cliques>("cliques", "", 1, 64, "distinct cliques kept"),
  };
  return kFields;
}

void GraphRejector::reserve(Arena& arena, const Limits& limits) {
  const std::size_t pairs = std::min(params_.max_pairs, limits.max_correspondences);
  const std::size_t words = (pairs + 63) / 64;
  ends_.reserve(arena, pairs);
  adjacency_ = arena.take<std::uint64_t>(pairs * words);
  cliques_ = arena.take<std::uint64_t>(params_.cliques * words);
  sizes_ = arena.take<std::size_t>(params_.cliques);
  for (std::span<std::uint64_t>* bits : {&candidates_, &grown_, &kept_}) {
    *bits = arena.take<std::uint64_t>(words);
  }
  order_ = arena.take<std::int32_t>(std::max(pairs, limits.max_correspondences));
  for (std::span<std::int32_t>* list : {&core_, &position_, &bucket_}) {
    *list = arena.take<std::int32_t>(pairs + 1);
  }
  support_ = arena.take<std::uint32_t>(pairs);
  normals_ = arena.take<float>(6 * pairs);
}

void GraphRejector::shorten(Correspondences& correspondences) noexcept {
  const std::size_t count = correspondences.size();
  const std::size_t room = support_.size();
  if (count <= room) return;
  const std::span<std::int32_t> order = order_.first(count);
  std::iota(order.begin(), order.end(), 0);
  const auto last = order.begin() + static_cast<std::ptrdiff_t>(room);
  std::nth_element(order.begin(), last, order.end(), [&](std::int32_t a, std::int32_t b) {
    const float of_a = sort_key(correspondences[static_cast<std::size_t>(a)]);
    const float of_b = sort_key(correspondences[static_cast<std::size_t>(b)]);
    return of_a < of_b || (of_a == of_b && a < b);
  });
  std::sort(order.begin(), last);
  for (std::size_t i = 0; i < room; ++i) {
    correspondences[i] = correspondences[static_cast<std::size_t>(order[i])];
  }
  correspondences.resize(room);
}

void GraphRejector::drop_odd_normals(const PairView& pair,
                                     const Correspondences& correspondences) noexcept {
  for (std::size_t i = 0; i < count_; ++i) {
    const Vec3f s = pair.source->normal(source_point(pair, correspondences[i]));
    const Vec3f t = pair.target->normal(target_point(pair, correspondences[i]));
    // Without normals on both ends nothing is known of the angle.
    const bool known = !s.isZero() && !t.isZero();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      normals_[6 * i + axis] = known ? s[static_cast<Eigen::Index>(axis)] : 0.0F;
      normals_[6 * i + 3 + axis] = known ? t[static_cast<Eigen::Index>(axis)] : 0.0F;
    }
  }
  const auto tolerance = static_cast<float>(params_.normal_tolerance);
  for (std::size_t i = 0; i < count_; ++i) {
    const float* a = normals_.data() + 6 * i;
    for_each_bit(row(i), [&](std::size_t j) {
      if (j < i) return;
      const float* b = normals_.data() + 6 * j;
      const float source = (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2];
      const float target = (a[3] * b[3] + a[4] * b[4]) + a[5] * b[5];
      if (std::fabs(source - target) <= tolerance) return;
      clear(row(i), j);
      clear(row(j), i);
    });
  }
}

void GraphRejector::connect(const PairView& pair, const Correspondences& correspondences,
                            double tolerance_m) noexcept {
  // Pairs that share an end can't both be right.
  const kernels::PairAgreement agreement{static_cast<float>(tolerance_m),
                                         std::numeric_limits<float>::min()};
  for (std::size_t i = 0; i < count_; ++i) {
    kernels::agreeing_pairs(ends_.planes(), count_, i, agreement, row(i).data());
  }
  if (params_.normal_tolerance < 2.0) drop_odd_normals(pair, correspondences);
}

std::size_t GraphRejector::find_cores() noexcept {
  // Pairs sorted by degree in buckets; taking the lowest one lowers its neighbours.
  std::fill_n(bucket_.begin(), count_ + 1, 0);
  for (std::size_t i = 0; i < count_; ++i) {
    core_[i] = static_cast<std::int32_t>(bits_of(row(i)));
    ++bucket_[static_cast<std::size_t>(core_[i])];
  }
  std::int32_t start = 0;
  for (std::size_t degree = 0; degree <= count_; ++degree) {
    const std::int32_t size = bucket_[degree];
    bucket_[degree] = start;
    start += size;
  }
  for (std::size_t i = 0; i < count_; ++i) {
    const auto degree = static_cast<std::size_t>(core_[i]);
    position_[i] = bucket_[degree]++;
    order_[static_cast<std::size_t>(position_[i])] = static_cast<std::int32_t>(i);
  }
  for (std::size_t degree = count_; degree > 0; --degree) bucket_[degree] = bucket_[degree - 1];
  bucket_[0] = 0;
  for (std::size_t at = 0; at < count_; ++at) {
    const auto taken = static_cast<std::size_t>(order_[at]);
    for_each_bit(row(taken), [&](std::size_t other) {
      if (core_[other] <= core_[taken]) return;
      // Swaps the other to the front of its bucket, which then begins one later.
      const auto degree = static_cast<std::size_t>(core_[other]);
      const std::int32_t front = bucket_[degree];
      const auto first = static_cast<std::size_t>(order_[static_cast<std::size_t>(front)]);
      std::swap(order_[static_cast<std::size_t>(position_[other])],
                order_[static_cast<std::size_t>(front)]);
      std::swap(position_[other], position_[first]);
      ++bucket_[degree];
      --core_[other];
    });
  }
  return static_cast<std::size_t>(
      *std::max_element(core_.begin(), core_.begin() + static_cast<std::ptrdiff_t>(count_)));
}

void GraphRejector::score_seeds() noexcept {
  for (std::size_t i = 0; i < count_; ++i) {
    std::size_t support = 0;
    for_each_bit(row(i), [&](std::size_t j) { support += bits_of_both(row(i), row(j)); });
    support_[i] = static_cast<std::uint32_t>(support);
  }
}

std::size_t GraphRejector::grow(std::size_t seed, std::span<std::uint64_t> clique) noexcept {
  const std::span<std::uint64_t> candidates = candidates_.first(words_);
  std::ranges::fill(clique, 0U);
  std::ranges::copy(row(seed), candidates.begin());
  set(clique, seed);
  std::size_t size = 1;
  for (;;) {
    // The candidate that agrees with most of the others; the first of equals.
    std::size_t best = count_;
    std::size_t most = 0;
    for_each_bit(candidates, [&](std::size_t j) {
      const std::size_t shared = bits_of_both(candidates, row(j)) + 1;
      if (shared > most) {
        most = shared;
        best = j;
      }
    });
    if (best == count_) return size;
    set(clique, best);
    ++size;
    for (std::size_t word = 0; word < words_; ++word) candidates[word] &= row(best)[word];
  }
}

void GraphRejector::keep_clique(std::span<const std::uint64_t> clique, std::size_t size) noexcept {
  const auto held = [&](std::size_t i) { return cliques_.subspan(i * words_, words_); };
  for (std::size_t i = 0; i < found_; ++i) {
    if (bits_of_both(clique, held(i)) * kDistinct <= std::min(size, sizes_[i])) continue;
    if (size > sizes_[i]) {
      std::ranges::copy(clique, held(i).begin());
      sizes_[i] = size;
    }
    return;
  }
  std::size_t at = found_;
  if (found_ < params_.cliques) {
    ++found_;
  } else {
    at = static_cast<std::size_t>(std::min_element(sizes_.begin(), sizes_.end()) - sizes_.begin());
    if (sizes_[at] >= size) return;
  }
  std::ranges::copy(clique, held(at).begin());
  sizes_[at] = size;
}

/// A clique of n pairs lies in the core of degree n - 1: pairs whose core is less than half of the
/// largest are in no clique worth keeping.
void GraphRejector::prune(std::size_t highest) noexcept {
  const std::span<std::uint64_t> alive = candidates_.first(words_);
  std::ranges::fill(alive, 0U);
  for (std::size_t i = 0; i < count_; ++i) {
    if (2 * static_cast<std::size_t>(core_[i]) >= highest) set(alive, i);
  }
  for (std::size_t i = 0; i < count_; ++i) {
    for (std::size_t word = 0; word < words_; ++word) {
      row(i)[word] &= has(alive, i) ? alive[word] : 0U;
    }
  }
}

void GraphRejector::find_cliques() noexcept {
  prune(find_cores());
  score_seeds();
  const std::span<std::int32_t> order = order_.first(count_);
  std::iota(order.begin(), order.end(), 0);
  const std::size_t seeds = std::min(params_.seeds, count_);
  const auto stronger = [&](std::int32_t a, std::int32_t b) {
    const std::uint32_t of_a = support_[static_cast<std::size_t>(a)];
    const std::uint32_t of_b = support_[static_cast<std::size_t>(b)];
    return of_a > of_b || (of_a == of_b && a < b);
  };
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(seeds), order.end(),
                    stronger);
  const std::span<std::uint64_t> grown = grown_.first(words_);
  // A pair inside a clique that is kept would only grow it again.
  std::fill_n(kept_.begin(), words_, 0U);
  for (std::size_t k = 0; k < seeds; ++k) {
    const auto seed = static_cast<std::size_t>(order[k]);
    if (has(kept_, seed)) continue;
    const std::size_t size = grow(seed, grown);
    keep_clique(grown, size);
    for (std::size_t word = 0; word < words_; ++word) kept_[word] |= grown[word];
  }
}

std::size_t GraphRejector::mark_core() noexcept {
  const std::size_t highest = find_cores();
  std::fill_n(kept_.begin(), words_, 0U);
  for (std::size_t i = 0; i < count_; ++i) {
    if (static_cast<std::size_t>(core_[i]) == highest) set(kept_, i);
  }
  // Three pairs that agree make a core of degree 2.
  return highest + 1;
}

std::size_t GraphRejector::mark_cliques() noexcept {
  find_cliques();
  std::fill_n(kept_.begin(), words_, 0U);
  std::size_t largest = 0;
  for (std::size_t i = 0; i < found_; ++i) {
    largest = std::max(largest, sizes_[i]);
    if (sizes_[i] < 3) continue;
    for (std::size_t word = 0; word < words_; ++word) {
      kept_[word] |= cliques_[i * words_ + word];
    }
  }
  return largest;
}

Status GraphRejector::reject(const PairView& pair, Correspondences& correspondences,
                             Rng&) noexcept {
  const auto given = static_cast<std::int32_t>(correspondences.size());
  found_ = 0;
  if (given < 3) return Error{Code::TooFewCorrespondences, Stage::Reject, given};
  if (correspondences.size() > order_.size()) {
    return Error{Code::CapacityExceeded, Stage::Reject, given};
  }
  shorten(correspondences);
  count_ = correspondences.size();
  words_ = (count_ + 63) / 64;
  if (!ends_.gather(pair, correspondences)) {
    return Error{Code::CapacityExceeded, Stage::Reject, given};
  }
  connect(pair, correspondences,
          params_.tolerance_m > 0.0 ? params_.tolerance_m : 1.5 * pair.target->spacing_m);
  const std::size_t largest = params_.keep == GraphKeep::Core ? mark_core() : mark_cliques();
  if (largest < 3) {
    return Error{Code::NoConsensus, Stage::Reject, static_cast<std::int32_t>(largest)};
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    if (has(kept_, i)) correspondences[kept++] = correspondences[i];
  }
  correspondences.resize(kept);
  return {};
}

}  // namespace grapnel
