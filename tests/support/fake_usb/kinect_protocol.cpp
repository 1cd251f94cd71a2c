#include "tests/support/fake_usb/kinect_protocol.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "tests/support/fake_usb/fake_kinect.h"

namespace grapnel::test {
namespace {

constexpr std::size_t kHeader = 8;
constexpr std::uint16_t kWriteRegister = 0x03;
constexpr std::uint16_t kFixedParameters = 0x04;
constexpr std::uint16_t kAlgorithmParameters = 0x16;
constexpr std::uint16_t kRegistration = 0x40;
constexpr std::uint16_t kPadding = 0x41;
constexpr std::uint16_t kColorSwitch = 0x05;
constexpr std::uint16_t kDepthSwitch = 0x06;
constexpr std::uint8_t kReadAcceleration = 0x32;

std::uint16_t word(const std::uint8_t* data) {
  return static_cast<std::uint16_t>(data[0] | data[1] << 8);
}

void put_word(std::vector<std::uint8_t>& data, std::size_t at, std::size_t value) {
  data[at] = static_cast<std::uint8_t>(value);
  data[at + 1] = static_cast<std::uint8_t>(value >> 8);
}

/// Two bytes of result, then what was asked for.
std::vector<std::uint8_t> answer_to(std::uint16_t command, std::uint16_t parameter) {
  if (command == kFixedParameters) {
    std::vector<std::uint8_t> data(322, 0);
    const std::array<float, 4> plane = {kFakeEmitter_cm, kFakeColor_cm, kFakeReference_mm,
                                        kFakePixel_mm};
    std::memcpy(data.data() + 94, plane.data(), sizeof(plane));
    return data;
  }
  if (command != kAlgorithmParameters) return std::vector<std::uint8_t>(2, 0);
  if (parameter == kRegistration) return std::vector<std::uint8_t>(118, 0);
  if (parameter == kPadding) return std::vector<std::uint8_t>(8, 0);
  std::vector<std::uint8_t> data(4, 0);
  put_word(data, 2, kFakeConstShift);
  return data;
}

}  // namespace

KinectProtocol::Switch KinectProtocol::write_command(const std::uint8_t* data, int bytes) {
  Switch change;
  if (bytes < static_cast<int>(kHeader) + 2) return change;
  const std::uint16_t command = word(data + 4);
  const std::uint16_t first = word(data + kHeader);
  const std::vector<std::uint8_t> answer = answer_to(command, first);
  reply_.assign(kHeader, 0);
  reply_[0] = 'R';
  reply_[1] = 'B';
  put_word(reply_, 2, answer.size() / 2);
  put_word(reply_, 4, command);
  put_word(reply_, 6, word(data + 6));
  reply_.insert(reply_.end(), answer.begin(), answer.end());
  if (command != kWriteRegister || bytes < static_cast<int>(kHeader) + 4) return change;
  const Turn turn = word(data + kHeader + 2) != 0 ? Turn::On : Turn::Off;
  if (first == kDepthSwitch) change.depth = turn;
  if (first == kColorSwitch) change.color = turn;
  return change;
}

int KinectProtocol::read_reply(std::uint8_t* data, int bytes) {
  const std::size_t length = std::min(reply_.size(), static_cast<std::size_t>(bytes));
  std::copy_n(reply_.begin(), length, data);
  return static_cast<int>(length);
}

int KinectProtocol::read_motor(std::uint8_t request, std::uint8_t* data, int bytes) {
  if (request != kReadAcceleration || bytes < 10) return 0;
  std::fill_n(data, 10, std::uint8_t{0});
  for (int axis = 0; axis < 3; ++axis) {
    const auto value = static_cast<std::uint16_t>(grapnel_fake_kinect()->acceleration[axis].load());
    data[2 + 2 * axis] = static_cast<std::uint8_t>(value >> 8);
    data[3 + 2 * axis] = static_cast<std::uint8_t>(value);
  }
  return 10;
}

}  // namespace grapnel::test
