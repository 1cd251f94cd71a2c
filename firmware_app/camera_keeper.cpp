#include "firmware_app/camera_keeper.h"

#include <algorithm>
#include <span>
#include <utility>

#include "base/hash.h"

namespace grapnel {
namespace {

constexpr std::int64_t kLookUs = 100'000;
constexpr std::int64_t kFirstRetryUs = 200'000;
constexpr std::int64_t kLastRetryUs = 3'200'000;

}  // namespace

CameraKeeper::CameraKeeper(std::unique_ptr<Camera> camera, Parts parts,
                           const Scheduling& scheduling, std::string calibrated_serial)
    : camera_(std::move(camera)),
      parts_(parts),
      scheduling_(scheduling),
      calibrated_serial_(std::move(calibrated_serial)) {}

bool CameraKeeper::start() {
  return thread_.start([](void* self) { static_cast<CameraKeeper*>(self)->run(); }, this);
}

void CameraKeeper::stop() {
  stop_.store(true, std::memory_order_release);
  wake_.notify();
  thread_.join();
}

Code CameraKeeper::code() const noexcept {
  if (too_large_.load(std::memory_order_relaxed)) return Code::CapacityExceeded;
  if (opening_.load(std::memory_order_acquire)) return Code::SensorOpening;
  const Code refused = refused_.load(std::memory_order_relaxed);
  if (refused != Code::SensorHealthy) return refused;
  const CameraStatus status = camera_->status();
  if (status.state == CameraState::Streaming) return status.code;
  return status.code == Code::SensorHealthy ? Code::NoFrameInTime : status.code;
}

std::string CameraKeeper::serial() const {
  const std::lock_guard lock(serial_mutex_);
  return serial_;
}

void CameraKeeper::on_capture_thread() noexcept {
  name_this_thread("capture");
  touch_stack();
  if (!schedule_this_thread(scheduling_)) {
    scheduling_refused_.store(true, std::memory_order_relaxed);
  }
  parts_.account->attach();
  parts_.account->restart();
  parts_.account->sample();
}

bool CameraKeeper::open_and_start() {
  const Result<CameraInfo> info = camera_->open();
  refused_.store(info ? Code::SensorHealthy : info.error().code, std::memory_order_relaxed);
  if (!info) {
    const std::string problem = camera_->problem();
    if (problem != told_) parts_.journal->write(LogLevel::Warning, "camera: " + problem);
    told_ = problem;
    return false;
  }
  const CameraInfo& camera = info.value();
  const Intrinsics& shape = camera.intrinsics;
  if (shape.width > parts_.pool->max_width() || shape.height > parts_.pool->max_height()) {
    too_large_.store(true);
    parts_.journal->write(LogLevel::Fault,
                          "camera: " + std::to_string(shape.width) + " x " +
                              std::to_string(shape.height) +
                              " pixels; capture.max_width and capture.max_height allow " +
                              std::to_string(parts_.pool->max_width()) + " x " +
                              std::to_string(parts_.pool->max_height()));
    return false;
  }
  live_.store(camera.live, std::memory_order_relaxed);
  {
    const std::lock_guard lock(serial_mutex_);
    serial_ = camera.serial;
  }
  const auto serial = std::as_bytes(std::span(camera.serial.data(), camera.serial.size()));
  serial_hash_.store(static_cast<std::uint32_t>(hash_bytes(serial)), std::memory_order_relaxed);
  const bool foreign = !calibrated_serial_.empty() && calibrated_serial_ != camera.serial;
  parts_.foreign_sensor->store(foreign, std::memory_order_relaxed);
  if (foreign) {
    parts_.journal->write(LogLevel::Warning, "calibration.serial: \"" + calibrated_serial_ +
                                                 "\", the camera is \"" + camera.serial +
                                                 "\"; poses stay in the camera's frame");
  }
  CaptureHooks hooks;
  hooks.context = this;
  hooks.thread_started = [](void* self) noexcept {
    static_cast<CameraKeeper*>(self)->on_capture_thread();
  };
  hooks.progress = [](void* context) noexcept {
    auto* self = static_cast<CameraKeeper*>(context);
    self->parts_.supervisor->progress(Supervised::Capture).fetch_add(1, std::memory_order_relaxed);
    self->parts_.account->sample();
  };
  if (!camera_->start(*parts_.pool, hooks)) return false;
  parts_.supervisor->expect(Supervised::Capture, true);
  parts_.journal->write(LogLevel::Info, "camera: " + camera.driver + " " + camera.model + " " +
                                            camera.serial + ", " + std::to_string(shape.width) +
                                            " x " + std::to_string(shape.height) +
                                            (camera.live ? "" : ", recorded data"));
  return true;
}

void CameraKeeper::run() {
  name_this_thread("camera");
  std::int64_t retry_us = kFirstRetryUs;
  bool started = false;
  while (!stop_.load(std::memory_order_acquire)) {
    const std::uint32_t seen = wake_.version();
    if (!started) {
      started = open_and_start();
      opening_.store(false, std::memory_order_release);
      wake_.wait(seen, started ? kLookUs : retry_us);
      retry_us = std::min(2 * retry_us, kLastRetryUs);
      continue;
    }
    if (camera_->status().state == CameraState::Closed) {
      parts_.supervisor->expect(Supervised::Capture, false);
      started = false;
      retry_us = kFirstRetryUs;
    }
    wake_.wait(seen, kLookUs);
  }
  parts_.supervisor->expect(Supervised::Capture, false);
  camera_->close();
}

}  // namespace grapnel
