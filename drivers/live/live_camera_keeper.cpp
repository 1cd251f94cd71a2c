// The half of LiveCamera that runs on its keeper thread.
#include <algorithm>
#include <utility>

#include "base/clock.h"
#include "drivers/live/live_camera.h"

namespace grapnel {
namespace {

constexpr std::int64_t kLook_us = 20'000;
constexpr std::int64_t kFirstRetry_us = 100'000;
// With a first frame after about a second, the device is back within three.
constexpr std::int64_t kLastRetry_us = 800'000;
constexpr std::int64_t kFramesStopped_us = 1'000'000;
constexpr std::int64_t kFirstFrame_us = 3'000'000;
// Openings that never returned: beyond that many, only the device's return can help.
constexpr int kMaxHung = 4;

constexpr const char* kHung = "a call of the capture library has not returned in time";

}  // namespace

void LiveCamera::keep() {
  std::int64_t retry_us = kFirstRetry_us;
  while (!closing_.load()) {
    const std::uint64_t before = up_generation_.load();
    if (DeviceSession* const session = launch_session(); session != nullptr) {
      watch(*session);
      session->leave();
    } else {
      lose(generation_, Code::SensorNotConnected, kHung);
    }
    if (!open_.load() && answer_.load() != Code::SensorHealthy) return;
    retry_us =
        up_generation_.load() > before ? kFirstRetry_us : std::min(2 * retry_us, kLastRetry_us);
    const std::int64_t until_us = MonotonicClock().now_us() + retry_us;
    while (!closing_.load() && MonotonicClock().now_us() < until_us) {
      shared_->changed.wait(shared_->changed.version(), kLook_us);
    }
  }
}

DeviceSession* LiveCamera::launch_session() {
  if (shared_->holders.load() > kMaxHung) return nullptr;
  // Freed by leave() of its two parties.
  auto* const session =
      new DeviceSession(driver_.make_device(), serial_, ++generation_, *shared_, sense_);
  if (driver_.launch(session)) return session;
  shared_->leave();
  session->leave();
  session->leave();
  return nullptr;
}

void LiveCamera::watch(DeviceSession& session) {
  bool welcomed = false;
  bool hung = false;
  for (;;) {
    const std::uint32_t seen = shared_->changed.version();
    const std::int64_t time_us = MonotonicClock().now_us();
    const DeviceSession::Phase phase = session.phase();
    if (phase == DeviceSession::Phase::Ended) break;
    if (phase != DeviceSession::Phase::Opening && !welcomed) {
      welcomed = true;
      if (!welcome(session)) session.end();
    }
    take_gravity(session);
    if (closing_.load()) session.end();
    if (session.overdue(time_us)) {
      if (session.sensing()) sense_ = false;
      if (!hung) lose(session.generation(), Code::NoFrameInTime, kHung);
      hung = true;
      session.end();
      if (driver_.replaceable || closing_.load()) return;
    } else if (frames_stopped(session, time_us)) {
      lose(session.generation(), Code::NoFrameInTime, "the sensor sends no more frames");
      session.end();
    }
    shared_->changed.wait(seen, kLook_us);
  }
  if (session.code() != Code::SensorHealthy) {
    lose(session.generation(), session.code(), session.problem());
  }
}

bool LiveCamera::welcome(const DeviceSession& session) {
  const CameraInfo& info = session.info();
  const FrameExchange* const exchange = shared_->frames.get();
  if (exchange != nullptr && (exchange->width() != info.intrinsics.width ||
                              exchange->height() != info.intrinsics.height)) {
    lose(session.generation(), Code::WrongSerial, "the sensor came back with another image size");
    return false;
  }
  if (!has_answer_.load()) {
    info_ = info;
    serial_ = info.serial;
  }
  if (exchange == nullptr) {
    shared_->frames = std::make_unique<FrameExchange>(info.intrinsics.width, info.intrinsics.height,
                                                      info.has_color);
    shared_->exchange.store(shared_->frames.get());
    timer_.emplace(info.nominal_rate_hz, driver_.latency_us);
  }
  // While it streams, only a frame proves that the sensor works again.
  if (!started_.load()) up_generation_.store(session.generation());
  announce(Code::SensorHealthy);
  return true;
}

bool LiveCamera::frames_stopped(const DeviceSession& session, std::int64_t now_us) const {
  const std::int64_t since_us = session.streaming_since_us();
  if (since_us == 0 || !shared_->stream.load() || shared_->ended.load()) return false;
  const std::int64_t last_us = last_frame_us_.load();
  return last_us < since_us ? now_us - since_us > kFirstFrame_us
                            : now_us - last_us > kFramesStopped_us;
}

void LiveCamera::take_gravity(const DeviceSession& session) noexcept {
  std::array<float, 3> gravity{};
  session.gravity(gravity);
  for (std::size_t i = 0; i < 3; ++i) gravity_[i].store(gravity[i]);
}

void LiveCamera::lose(std::uint64_t generation, Code code, const std::string& problem) {
  // Whoever reads the state Lost finds its reason: the generation, which says it, comes last.
  if (!problem.empty()) set_problem(problem);
  lost_code_.store(code);
  lost_generation_.store(generation);
  last_frame_us_.store(0);
  announce(code);
}

void LiveCamera::announce(Code code) {
  if (has_answer_.load()) return;
  answer_.store(code);
  has_answer_.store(true);
  answered_.notify();
}

}  // namespace grapnel
