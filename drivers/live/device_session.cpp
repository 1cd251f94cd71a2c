#include "drivers/live/device_session.h"

#include <exception>
#include <utility>

#include "base/clock.h"

namespace grapnel {
namespace {

// How long a call of the library may take before it counts as hung.
constexpr std::int64_t kOpen_us = 5'000'000;
constexpr std::int64_t kStart_us = 3'000'000;
constexpr std::int64_t kPump_us = 1'000'000;
constexpr std::int64_t kStop_us = 2'000'000;
constexpr std::int64_t kSense_us = 1'000'000;
constexpr std::int64_t kSensePeriod_us = 1'000'000;

}  // namespace

/// Marks the time within which the call under way must return.
class DeviceSession::Call {
 public:
  Call(DeviceSession& session, std::int64_t limit_us) noexcept : session_(session) {
    session_.call_ends_us_.store(MonotonicClock().now_us() + limit_us);
  }
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;
  ~Call() { session_.call_ends_us_.store(0); }

 private:
  DeviceSession& session_;
};

DeviceSession::DeviceSession(std::unique_ptr<SensorDevice> device, std::string serial,
                             std::uint64_t generation, Orders& orders, bool sense)
    : device_(std::move(device)),
      serial_(std::move(serial)),
      generation_(generation),
      orders_(orders),
      sense_(sense) {
  orders_.holders.fetch_add(1);
  // A thread that never comes counts as a hung opening.
  call_ends_us_.store(MonotonicClock().now_us() + kOpen_us);
}

void DeviceSession::leave() noexcept {
  if (parties_.fetch_sub(1) == 1) delete this;
}

bool DeviceSession::overdue(std::int64_t now_us) const noexcept {
  const std::int64_t ends_us = call_ends_us_.load();
  return ends_us != 0 && now_us > ends_us;
}

std::string DeviceSession::problem() const {
  const std::lock_guard lock(problem_mutex_);
  return problem_;
}

bool DeviceSession::gravity(std::array<float, 3>& gravity) const noexcept {
  if (!has_gravity_.load()) return false;
  for (std::size_t i = 0; i < 3; ++i) gravity[i] = gravity_[i].load(std::memory_order_relaxed);
  return true;
}

void DeviceSession::set_phase(Phase phase) noexcept {
  phase_.store(phase);
  orders_.changed.notify();
}

void DeviceSession::fail(const Error& error) {
  {
    const std::lock_guard lock(problem_mutex_);
    problem_ = device_->problem();
  }
  code_.store(error.code);
}

void DeviceSession::run() noexcept {
  try {
    if (!end_.load() && open()) {
      while (!end_.load() && turn()) {
      }
    }
  } catch (const std::exception&) {
    code_.store(Code::InternalFault);
  }
  {
    const Call call(*this, kStop_us);
    if (streaming_) device_->stop();
    device_->close();
  }
  Orders& orders = orders_;
  set_phase(Phase::Ended);
  leave();
  orders.leave();
}

bool DeviceSession::open() {
  const Call call(*this, kOpen_us);
  const Result<CameraInfo> info = device_->open(serial_);
  if (!info) {
    fail(info.error());
    return false;
  }
  info_ = info.value();
  set_phase(Phase::Open);
  return true;
}

bool DeviceSession::turn() {
  const bool wanted = orders_.stream.load();
  Status done;
  if (wanted != streaming_) {
    const Call call(*this, wanted ? kStart_us : kStop_us);
    if (wanted) {
      done = device_->start(*orders_.exchange.load(), generation_);
    } else {
      device_->stop();
    }
    streaming_ = wanted && done.ok();
    streaming_since_us_.store(streaming_ ? MonotonicClock().now_us() : 0);
    if (done) set_phase(streaming_ ? Phase::Streaming : Phase::Open);
  }
  if (done) {
    const Call call(*this, kPump_us);
    done = device_->pump();
  }
  orders_.ended.store(streaming_ && device_->ended());
  if (!done) fail(done.error());
  if (done && sense_) sense();
  return done.ok();
}

void DeviceSession::sense() {
  const std::int64_t now_us = MonotonicClock().now_us();
  if (sensed_us_ != 0 && now_us - sensed_us_ < kSensePeriod_us) return;
  sensed_us_ = now_us;
  const Call call(*this, kSense_us);
  sensing_.store(true);
  std::array<double, 3> gravity{};
  if (device_->read_gravity(gravity)) {
    for (std::size_t i = 0; i < 3; ++i) gravity_[i].store(static_cast<float>(gravity[i]));
    has_gravity_.store(true);
  } else {
    has_gravity_.store(false);
    sense_ = false;
  }
  sensing_.store(false);
}

}  // namespace grapnel
