#include "hal/frame_pool.h"

#include <limits>
#include <utility>

#include "base/assert.h"

namespace grapnel {

// `users` is the slot's only gate: kWriting while the writer owns it, else the number of leases.
// `order` is 0 while the slot holds no frame. A reader that raised `users` owns the content.
struct FramePool::Cell {
  static constexpr std::int32_t kWriting = -1;

  std::atomic<std::int32_t> users{0};
  std::atomic<std::uint64_t> order{0};
  std::atomic<std::int64_t> exposure_us{0};
  Slot slot;
};

FrameLease::FrameLease(FrameLease&& other) noexcept
    : pool_(std::exchange(other.pool_, nullptr)), slot_(other.slot_) {}

FrameLease& FrameLease::operator=(FrameLease&& other) noexcept {
  if (this != &other) {
    release();
    pool_ = std::exchange(other.pool_, nullptr);
    slot_ = other.slot_;
  }
  return *this;
}

const DepthFrame& FrameLease::frame() const noexcept {
  GRAPNEL_ASSERT(valid());
  return pool_->cells_[slot_].slot.frame;
}

void FrameLease::release() noexcept {
  if (pool_ != nullptr) pool_->release(slot_);
  pool_ = nullptr;
}

FramePool::FramePool(std::size_t slots, int max_width, int max_height, bool with_color)
    : max_width_(max_width), max_height_(max_height), with_color_(with_color), count_(slots) {
  GRAPNEL_ASSERT(slots >= 2 && max_width > 0 && max_height > 0);
  const std::size_t pixels =
      static_cast<std::size_t>(max_width) * static_cast<std::size_t>(max_height);
  cells_ = std::make_unique<Cell[]>(slots);
  depth_.assign(slots * pixels, 0);
  if (with_color) color_.assign(slots * pixels, Rgb8{});
  bytes_ =
      slots * sizeof(Cell) + depth_.size() * sizeof(std::uint16_t) + color_.size() * sizeof(Rgb8);
  for (std::size_t i = 0; i < slots; ++i) {
    cells_[i].slot.depth = depth_.data() + i * pixels;
    cells_[i].slot.color = with_color ? color_.data() + i * pixels : nullptr;
  }
}

FramePool::~FramePool() = default;

FramePool::Slot* FramePool::begin_write() noexcept {
  // Oldest first; a slot may be leased between the look and the claim, so look again then.
  for (std::size_t attempt = 0; attempt < count_; ++attempt) {
    Cell* oldest = nullptr;
    std::uint64_t oldest_order = std::numeric_limits<std::uint64_t>::max();
    for (std::size_t i = 0; i < count_; ++i) {
      Cell& cell = cells_[i];
      if (cell.users.load(std::memory_order_relaxed) != 0) continue;
      const std::uint64_t order = cell.order.load(std::memory_order_relaxed);
      if (order < oldest_order) {
        oldest = &cell;
        oldest_order = order;
      }
    }
    if (oldest == nullptr) return nullptr;
    std::int32_t expected = 0;
    if (oldest->users.compare_exchange_strong(expected, Cell::kWriting,
                                              std::memory_order_acq_rel)) {
      oldest->order.store(0, std::memory_order_relaxed);
      return &oldest->slot;
    }
  }
  return nullptr;
}

void FramePool::publish(Slot* slot) noexcept {
  if (filter_ != nullptr) filter_->apply(*slot);
  for (std::size_t i = 0; i < count_; ++i) {
    Cell& cell = cells_[i];
    if (&cell.slot != slot) continue;
    cell.exposure_us.store(slot->frame.exposure_us, std::memory_order_relaxed);
    cell.order.store(++order_, std::memory_order_relaxed);
    cell.users.store(0, std::memory_order_release);
    published_.fetch_add(1, std::memory_order_release);
    signal_.notify();
    return;
  }
  GRAPNEL_ASSERT(false && "slot is not of this pool");
}

void FramePool::discard(Slot* slot) noexcept {
  for (std::size_t i = 0; i < count_; ++i) {
    Cell& cell = cells_[i];
    if (&cell.slot != slot) continue;
    cell.users.store(0, std::memory_order_release);
    return;
  }
  GRAPNEL_ASSERT(false && "slot is not of this pool");
}

template <class Better>
FrameLease FramePool::lease_best(Better better) noexcept {
  // The writer may take the best slot between the look and the lease; then there is a newer best.
  for (std::size_t attempt = 0; attempt < 2 * count_; ++attempt) {
    std::size_t best = count_;
    std::uint64_t best_order = 0;
    std::int64_t best_exposure_us = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const std::uint64_t order = cells_[i].order.load(std::memory_order_acquire);
      const std::int64_t exposure_us = cells_[i].exposure_us.load(std::memory_order_relaxed);
      if (order == 0 || cells_[i].users.load(std::memory_order_relaxed) < 0) continue;
      if (!better(order, exposure_us, best_order, best_exposure_us, best == count_)) continue;
      best = i;
      best_order = order;
      best_exposure_us = exposure_us;
    }
    if (best == count_) return {};
    Cell& cell = cells_[best];
    std::int32_t users = cell.users.load(std::memory_order_relaxed);
    while (users >= 0 &&
           !cell.users.compare_exchange_weak(users, users + 1, std::memory_order_acq_rel)) {
    }
    if (users < 0) continue;
    if (cell.order.load(std::memory_order_relaxed) == best_order) return {this, best};
    release(best);
  }
  return {};
}

FrameLease FramePool::lease_latest() noexcept {
  return lease_best([](std::uint64_t order, std::int64_t, std::uint64_t best_order, std::int64_t,
                       bool first) { return first || order > best_order; });
}

FrameLease FramePool::lease_first_since(std::int64_t not_before_us) noexcept {
  return lease_best([not_before_us](std::uint64_t order, std::int64_t exposure_us,
                                    std::uint64_t best_order, std::int64_t, bool first) {
    return exposure_us >= not_before_us && (first || order < best_order);
  });
}

FrameLease FramePool::lease_nearest(std::int64_t time_us) noexcept {
  return lease_best([time_us](std::uint64_t order, std::int64_t exposure_us,
                              std::uint64_t best_order, std::int64_t best_exposure_us, bool first) {
    if (first) return true;
    const std::int64_t distance =
        exposure_us > time_us ? exposure_us - time_us : time_us - exposure_us;
    const std::int64_t best =
        best_exposure_us > time_us ? best_exposure_us - time_us : time_us - best_exposure_us;
    return distance < best || (distance == best && order > best_order);
  });
}

void FramePool::release(std::size_t slot) noexcept {
  cells_[slot].users.fetch_sub(1, std::memory_order_acq_rel);
}

void FramePool::invalidate() noexcept {
  for (std::size_t i = 0; i < count_; ++i) {
    std::int32_t expected = 0;
    Cell& cell = cells_[i];
    if (!cell.users.compare_exchange_strong(expected, Cell::kWriting, std::memory_order_acq_rel))
      continue;
    cell.order.store(0, std::memory_order_relaxed);
    cell.users.store(0, std::memory_order_release);
  }
}

}  // namespace grapnel
