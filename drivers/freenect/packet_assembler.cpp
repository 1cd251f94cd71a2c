#include "drivers/freenect/packet_assembler.h"

#include <algorithm>
#include <cstring>

namespace grapnel {

void PacketAssembler::write(const std::uint8_t* data, int number, std::size_t bytes) noexcept {
  const std::size_t begin = static_cast<std::size_t>(number) * packet_bytes_;
  if (number >= 0 && begin < frame_bytes_) {
    std::memcpy(frame_ + begin, data, std::min(bytes, frame_bytes_ - begin));
  }
  last_ = number;
}

void PacketAssembler::add(std::uint8_t* frame, const std::uint8_t* data, int number,
                          std::size_t bytes) noexcept {
  if (frame_ == nullptr) std::memset(frame, blank_, frame_bytes_);
  frame_ = frame;
  // The library gave the frame before up: it was never delivered.
  if (waiting_ != kNone) next_frame();
  if (number > last_ || bytes > kMaxPacket) return write(data, number, bytes);
  waiting_ = number;
  waiting_bytes_ = bytes;
  std::memcpy(waiting_data_.data(), data, bytes);
}

void PacketAssembler::next_frame() noexcept {
  if (frame_ == nullptr) return;
  std::memset(frame_, blank_, frame_bytes_);
  last_ = kNone;
  if (waiting_ != kNone) write(waiting_data_.data(), waiting_, waiting_bytes_);
  waiting_ = kNone;
}

}  // namespace grapnel
