#include "tests/support/fake_usb/kinect_stream.h"

#include <algorithm>
#include <cstring>
#include <limits>

namespace grapnel::test {
namespace {

constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kDepthData = 1748;
constexpr std::size_t kColorData = 1908;
constexpr std::size_t kPixels = std::size_t{kFakeWidth} * kFakeHeight;

std::vector<std::uint8_t> pack_depth(std::uint64_t n) {
  std::vector<std::uint8_t> packed;
  packed.reserve(kPixels * 11 / 8);
  std::uint32_t bits = 0;
  int held = 0;
  for (int v = 0; v < kFakeHeight; ++v) {
    for (int u = 0; u < kFakeWidth; ++u) {
      bits = (bits << 11) | fake_raw_depth(u, v, n);
      held += 11;
      for (; held >= 8; held -= 8) packed.push_back(static_cast<std::uint8_t>(bits >> (held - 8)));
    }
  }
  return packed;
}

/// Rows G R G R and B G B G by turns.
std::vector<std::uint8_t> mosaic(std::uint64_t n) {
  std::vector<std::uint8_t> bayer;
  bayer.reserve(kPixels);
  for (int v = 0; v < kFakeHeight; ++v) {
    for (int u = 0; u < kFakeWidth; ++u) {
      const Rgb8 color = fake_color(u < kFakeWidth / 2, n);
      const bool green = (u + v) % 2 == 0;
      bayer.push_back(green ? color.g : v % 2 == 0 ? color.r : color.b);
    }
  }
  return bayer;
}

std::array<std::vector<std::uint8_t>, kFakePictures> all_pictures(KinectStream::Kind kind) {
  std::array<std::vector<std::uint8_t>, kFakePictures> pictures;
  for (std::uint64_t n = 0; n < kFakePictures; ++n) {
    pictures[n] = kind == KinectStream::Kind::Depth ? pack_depth(n) : mosaic(n);
  }
  return pictures;
}

}  // namespace

const std::vector<std::uint8_t>& KinectStream::picture() const {
  static const auto depth = all_pictures(Kind::Depth);
  static const auto color = all_pictures(Kind::Color);
  return (kind_ == Kind::Depth ? depth : color)[frame_ % kFakePictures];
}

int KinectStream::packets() const noexcept { return kind_ == Kind::Depth ? 242 : 162; }

void KinectStream::switch_on(std::int64_t epoch_us, std::int64_t now_us) {
  static_cast<void>(picture());
  const FakeKinect& kinect = *grapnel_fake_kinect();
  epoch_us_ = epoch_us;
  period_us_ = 1'000'000 / kinect.rate_hz.load();
  frame_ = static_cast<std::uint64_t>((now_us - epoch_us) / period_us_) + 1;
  packet_ = 0;
  on_ = true;
}

bool KinectStream::withdraw(libusb_transfer* transfer) {
  const auto place = std::find(queue_.begin(), queue_.end(), transfer);
  if (place == queue_.end()) return false;
  queue_.erase(place);
  return true;
}

libusb_transfer* KinectStream::take_any() {
  if (queue_.empty()) return nullptr;
  libusb_transfer* const transfer = queue_.front();
  queue_.pop_front();
  return transfer;
}

std::int64_t KinectStream::due_us(std::uint64_t frame, int packet) const noexcept {
  return epoch_us_ + static_cast<std::int64_t>(frame) * period_us_ +
         packet * period_us_ * 9 / (10 * packets());
}

std::uint32_t KinectStream::ticks() const noexcept {
  const FakeKinect& kinect = *grapnel_fake_kinect();
  const std::int64_t skew_us = kind_ == Kind::Color ? kinect.color_skew_us.load() : 0;
  const std::int64_t time_us = static_cast<std::int64_t>(frame_) * period_us_ + skew_us;
  return kinect.first_ticks.load() + static_cast<std::uint32_t>(time_us * kFakeTicksPerUs);
}

bool KinectStream::lose_packet() {
  FakeKinect& kinect = *grapnel_fake_kinect();
  static std::uint64_t sent = 0;
  ++sent;
  const auto every = static_cast<std::uint64_t>(kinect.lose_every.load());
  if (kind_ == Kind::Depth && packet_ == 100) losing_ += kinect.lose_next.exchange(0);
  const bool in_row = losing_ > 0;
  if (in_row) --losing_;
  const bool lost = in_row || (every != 0 && sent % every == 0);
  if (lost) ++(kind_ == Kind::Depth ? kinect.depth_packets_lost : kinect.color_packets_lost);
  return lost;
}

void KinectStream::write_packet(std::uint8_t* out, libusb_iso_packet_descriptor& packet) {
  const FakeKinect& kinect = *grapnel_fake_kinect();
  packet.status = LIBUSB_TRANSFER_COMPLETED;
  packet.actual_length = 0;
  const bool mute = kind_ == Kind::Color && kinect.color_frozen.load() != 0;
  if (mute || lose_packet()) return;
  const std::vector<std::uint8_t>& data = picture();
  const std::size_t size = kind_ == Kind::Depth ? kDepthData : kColorData;
  const std::size_t begin = static_cast<std::size_t>(packet_) * size;
  const std::size_t bytes = std::min(size, data.size() - begin);
  const std::uint8_t stream = kind_ == Kind::Depth ? 0x70 : 0x80;
  const int part = packet_ == 0 ? 1 : packet_ == packets() - 1 ? 5 : 2;
  const std::uint32_t time = kinect.clock_frozen.load() != 0 ? frozen_ticks_ : ticks();
  frozen_ticks_ = time;
  const std::array<std::uint8_t, kHeaderBytes> header = {'R',
                                                         'B',
                                                         0,
                                                         static_cast<std::uint8_t>(stream | part),
                                                         0,
                                                         sequence_,
                                                         0,
                                                         0,
                                                         static_cast<std::uint8_t>(time),
                                                         static_cast<std::uint8_t>(time >> 8),
                                                         static_cast<std::uint8_t>(time >> 16),
                                                         static_cast<std::uint8_t>(time >> 24)};
  std::memcpy(out, header.data(), kHeaderBytes);
  std::memcpy(out + kHeaderBytes, data.data() + begin, bytes);
  packet.actual_length = static_cast<unsigned>(kHeaderBytes + bytes);
}

void KinectStream::next_packet(std::int64_t now_us) {
  ++sequence_;
  if (++packet_ < packets()) return;
  packet_ = 0;
  ++frame_;
  if (kind_ == Kind::Depth) ++grapnel_fake_kinect()->depth_frames;
  // Who comes much too late finds that whole frames were never sent.
  const std::uint64_t current = static_cast<std::uint64_t>((now_us - epoch_us_) / period_us_);
  if (current > frame_ + 15) frame_ = current;
}

std::int64_t KinectStream::next_us() const noexcept {
  if (!on_ || queue_.empty() || grapnel_fake_kinect()->silent.load() != 0) {
    return std::numeric_limits<std::int64_t>::max();
  }
  return due_us(frame_, packet_ + queue_.front()->num_iso_packets);
}

libusb_transfer* KinectStream::finish(std::int64_t now_us) {
  if (next_us() > now_us) return nullptr;
  libusb_transfer* const transfer = queue_.front();
  const int count = transfer->num_iso_packets;
  queue_.pop_front();
  std::uint8_t* out = transfer->buffer;
  for (int i = 0; i < count; ++i) {
    libusb_iso_packet_descriptor& packet = transfer->iso_packet_desc[i];
    write_packet(out, packet);
    out += packet.length;
    next_packet(now_us);
  }
  transfer->status = LIBUSB_TRANSFER_COMPLETED;
  return transfer;
}

}  // namespace grapnel::test
