#include "drivers/openni2/oni_device.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace grapnel {
namespace {

constexpr std::int64_t kPump_us = 20'000;
constexpr const char* kDefaultSerial = "recording";

}  // namespace

OniDevice::OniDevice(OpenNiOptions options, std::filesystem::path player)
    : options_(std::move(options)),
      player_(std::move(player)),
      pairing_(options_.color, [](FrameExchange::Slot& slot, const std::vector<Rgb8>& color) {
        std::copy(color.begin(), color.end(), slot.color.begin());
      }) {}

bool OniDevice::begin() {
  try {
    reader_.reset();
    reader_ = std::make_unique<OniReader>(player_, options_.recording);
    return true;
  } catch (const std::exception& error) {
    problem_ = error.what();
    return false;
  }
}

Result<CameraInfo> OniDevice::open(const std::string& serial) {
  static_cast<void>(serial);  // a file has none
  if (!begin()) return Error{Code::SensorNotConnected, Stage::Capture, 0};
  const OniHead& head = reader_->head();
  color_.resize(static_cast<std::size_t>(head.width) * static_cast<std::size_t>(head.height));
  return describe();
}

CameraInfo OniDevice::describe() const {
  const OniHead& head = reader_->head();
  CameraInfo info;
  info.driver = "openni2";
  info.model = std::filesystem::path(options_.recording).filename().string();
  info.serial = options_.serial.empty() ? kDefaultSerial : options_.serial;
  info.intrinsics = {head.width,
                     head.height,
                     0.5 * head.width / std::tan(0.5 * head.horizontal_fov_rad),
                     0.5 * head.height / std::tan(0.5 * head.vertical_fov_rad),
                     0.5 * head.width,
                     0.5 * head.height};
  if (options_.fx > 0.0) {
    info.intrinsics = {head.width, head.height, options_.fx, options_.fy, options_.cx, options_.cy};
  }
  info.metres_per_unit = head.metres_per_unit;
  info.baseline_m = options_.baseline_m;
  info.nominal_rate_hz = std::max(head.rate_hz, 1);
  info.has_color = options_.color && head.has_color != 0;
  info.live = false;
  return info;
}

Status OniDevice::start(FrameExchange& exchange, std::uint64_t generation) {
  generation_ = generation;
  if (ended_ && !begin()) return Error{Code::SensorNotConnected, Stage::Capture, 0};
  if (ended_) turn_over();
  ended_ = false;
  paced_ = false;
  pairing_.begin(exchange);
  streaming_ = true;
  return {};
}

void OniDevice::stop() noexcept {
  if (streaming_) pairing_.end();
  streaming_ = false;
}

/// The file begins anew: its times and numbers go on where they were.
void OniDevice::turn_over() {
  const double period_us = 1e6 / std::max(reader_->head().rate_hz, 1);
  round_us_ = last_us_ + static_cast<std::int64_t>(period_us);
  round_index_ = last_index_;
}

bool OniDevice::fetch() {
  record_ = reader_->next(kPump_us, bytes_);
  if (!record_) return false;
  if (record_->kind == OniKind::End) {
    record_.reset();
    ended_ = !options_.loop;
    if (options_.loop) {
      if (!begin()) throw InputError(problem_);
      turn_over();
    }
    return false;
  }
  record_->time_us += round_us_;
  record_->index += round_index_;
  return true;
}

Status OniDevice::pump() {
  if (!streaming_ || ended_ || reader_ == nullptr) {
    clock_.sleep_until_us(clock_.now_us() + kPump_us);
    return reader_ != nullptr ? Status() : Error{Code::SensorNotConnected, Stage::Capture, 0};
  }
  try {
    const std::int64_t until_us = clock_.now_us() + kPump_us;
    while (clock_.now_us() < until_us) {
      if (!record_ && !fetch()) break;
      if (!paced_) offset_us_ = clock_.now_us() - record_->time_us;
      paced_ = true;
      const std::int64_t due_us = record_->time_us + offset_us_;
      clock_.sleep_until_us(std::min(due_us, until_us));
      if (clock_.now_us() < due_us) break;
      deliver();
      record_.reset();
    }
  } catch (const std::exception& error) {
    problem_ = error.what();
    return Error{Code::SensorNotConnected, Stage::Capture, 0};
  }
  pairing_.tick(clock_.now_us());
  return {};
}

void OniDevice::deliver() {
  last_us_ = std::max(last_us_, record_->time_us);
  if (record_->kind == OniKind::Color) {
    std::memcpy(color_.data(), bytes_.data(), bytes_.size());
    pairing_.color_arrives(color_.data(), color_.size(), record_->time_us, 0);
    return;
  }
  last_index_ = record_->index;
  SensorStamp stamp;
  stamp.device_us = record_->time_us;
  stamp.arrival_us = clock_.now_us();
  stamp.index = static_cast<std::uint64_t>(record_->index);
  stamp.generation = generation_;
  FrameExchange::Slot* const slot = pairing_.depth_arrives(stamp);
  if (slot == nullptr) return;
  std::memcpy(slot->depth.data(), bytes_.data(), bytes_.size());
  pairing_.depth_ready();
}

}  // namespace grapnel
