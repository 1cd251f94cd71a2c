#pragma once

#include <libusb.h>

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

#include "tests/support/fake_usb/fake_kinect.h"

namespace grapnel::test {

/// One isochronous stream of the fake Kinect: turns frames into packets and packets into finished
/// transfers, in real time.
class KinectStream {
 public:
  enum class Kind { Depth, Color };
  explicit KinectStream(Kind kind) noexcept : kind_(kind) {}

  void switch_on(std::int64_t epoch_us, std::int64_t now_us);
  void switch_off() noexcept { on_ = false; }
  void submit(libusb_transfer* transfer) { queue_.push_back(transfer); }
  /// Removes it from the queue; false when it is not there.
  bool withdraw(libusb_transfer* transfer);
  /// Takes one transfer off the queue: for a device that has gone.
  libusb_transfer* take_any();
  /// When the next transfer is full; never, for a stream that sends nothing.
  [[nodiscard]] std::int64_t next_us() const noexcept;
  /// The next transfer that is full by `now_us`, nullptr when there is none.
  libusb_transfer* finish(std::int64_t now_us);
  [[nodiscard]] Kind kind() const noexcept { return kind_; }

 private:
  [[nodiscard]] int packets() const noexcept;
  [[nodiscard]] std::int64_t due_us(std::uint64_t frame, int packet) const noexcept;
  [[nodiscard]] std::uint32_t ticks() const noexcept;
  [[nodiscard]] const std::vector<std::uint8_t>& picture() const;
  void write_packet(std::uint8_t* out, libusb_iso_packet_descriptor& packet);
  [[nodiscard]] bool lose_packet();
  void next_packet(std::int64_t now_us);

  Kind kind_;
  bool on_ = false;
  std::deque<libusb_transfer*> queue_;
  std::int64_t epoch_us_ = 0;
  std::int64_t period_us_ = 33'333;
  std::uint64_t frame_ = 0;
  int packet_ = 0;
  std::uint8_t sequence_ = 0;
  int losing_ = 0;
  std::uint32_t frozen_ticks_ = 0;
};

}  // namespace grapnel::test
