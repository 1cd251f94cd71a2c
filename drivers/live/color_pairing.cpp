#include "drivers/live/color_pairing.h"

#include <cstdlib>
#include <utility>

namespace grapnel {

void ColorPairing::begin(FrameExchange& exchange) noexcept {
  exchange_ = &exchange;
  has_color_ = false;
}

FrameExchange::Slot* ColorPairing::depth_arrives(const SensorStamp& stamp) {
  publish(false);
  waiting_ = exchange_->claim();
  if (waiting_ != nullptr) waiting_->stamp = stamp;
  return waiting_;
}

void ColorPairing::depth_ready() {
  if (!wants_color_) {
    publish(false);
  } else if (has_color_ && paired()) {
    publish(true);
  }
}

void ColorPairing::color_arrives(const Rgb8* pixels, std::size_t count, std::int64_t device_us,
                                 std::uint32_t lost_packets) {
  color_.assign(pixels, pixels + count);
  color_us_ = device_us;
  color_lost_ = lost_packets;
  has_color_ = true;
  if (waiting_ == nullptr) return;
  if (paired()) {
    publish(true);
  } else if (color_us_ > waiting_->stamp.device_us) {
    publish(false);
  }
}

void ColorPairing::tick(std::int64_t now_us) {
  if (waiting_ == nullptr || now_us - waiting_->stamp.arrival_us <= kPatience_us) return;
  if (std::exchange(overdue_, true)) publish(false);
}

void ColorPairing::end() noexcept {
  if (waiting_ != nullptr) exchange_->discard(waiting_);
  waiting_ = nullptr;
}

bool ColorPairing::paired() const noexcept {
  return std::abs(color_us_ - waiting_->stamp.device_us) <= kSameMoment_us;
}

void ColorPairing::publish(bool with_color) {
  FrameExchange::Slot* const slot = std::exchange(waiting_, nullptr);
  overdue_ = false;
  if (slot == nullptr) return;
  if (with_color) {
    slot->has_color = true;
    slot->stamp.lost_packets += color_lost_;
    attach_(*slot, color_);
  }
  exchange_->publish(slot);
}

}  // namespace grapnel
