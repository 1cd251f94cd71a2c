#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace grapnel {

/// Puts a stream's packets into the library's raw frame in its stead, so that what a lost packet
/// would have filled reads as "nothing" and never as a stripe of an earlier or a later frame.
class PacketAssembler {
 public:
  /// `packet_bytes` of data a packet, `frame_bytes` a frame; `blank` fills what did not arrive.
  PacketAssembler(std::size_t packet_bytes, std::size_t frame_bytes, std::uint8_t blank) noexcept
      : packet_bytes_(packet_bytes), frame_bytes_(frame_bytes), blank_(blank) {}

  /// A stream begins: the frame's buffer is not ours yet.
  void begin() noexcept {
    last_ = kNone;
    waiting_ = kNone;
    frame_ = nullptr;
  }
  /// A packet of the frame under way, or, when its number does not rise, of the next one: that
  /// waits until the frame before it has been delivered or given up.
  void add(std::uint8_t* frame, const std::uint8_t* data, int number, std::size_t bytes) noexcept;
  /// The frame has been delivered.
  void next_frame() noexcept;

 private:
  static constexpr int kNone = -1;
  static constexpr std::size_t kMaxPacket = 2048;

  void write(const std::uint8_t* data, int number, std::size_t bytes) noexcept;

  std::size_t packet_bytes_;
  std::size_t frame_bytes_;
  std::uint8_t blank_;
  std::uint8_t* frame_ = nullptr;
  int last_ = kNone;
  int waiting_ = kNone;
  std::size_t waiting_bytes_ = 0;
  std::array<std::uint8_t, kMaxPacket> waiting_data_{};
};

}  // namespace grapnel
