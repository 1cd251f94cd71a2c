#include "drivers/live/frame_exchange.h"

namespace grapnel {

FrameExchange::FrameExchange(int width, int height, bool with_color)
    : width_(width), height_(height) {
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  for (Slot& slot : slots_) {
    slot.depth.assign(pixels, 0);
    if (with_color) slot.color.assign(pixels, Rgb8{});
  }
}

FrameExchange::Slot* FrameExchange::claim() noexcept {
  for (Slot& slot : slots_) {
    Slot::State expected = Slot::State::Free;
    if (!slot.state_.compare_exchange_strong(expected, Slot::State::Writing)) continue;
    slot.order_ = claimed_.fetch_add(1);
    slot.has_color = false;
    slot.stamp = {};
    return &slot;
  }
  return nullptr;
}

void FrameExchange::publish(Slot* slot) noexcept {
  slot->state_.store(Slot::State::Ready);
  arrived_.notify();
}

void FrameExchange::discard(Slot* slot) noexcept { slot->state_.store(Slot::State::Free); }

FrameExchange::Slot* FrameExchange::take() noexcept {
  Slot* oldest = nullptr;
  for (Slot& slot : slots_) {
    if (slot.state_.load() != Slot::State::Ready) continue;
    if (oldest == nullptr || slot.order_ < oldest->order_) oldest = &slot;
  }
  if (oldest != nullptr) oldest->state_.store(Slot::State::Reading);
  return oldest;
}

void FrameExchange::release(Slot* slot) noexcept { slot->state_.store(Slot::State::Free); }

}  // namespace grapnel
