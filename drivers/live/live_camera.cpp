#include "drivers/live/live_camera.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "base/clock.h"

namespace grapnel {
namespace {

constexpr std::int64_t kIdle_us = 50'000;
constexpr std::int64_t kLook_us = 20'000;
constexpr std::int64_t kAnswer_us = 6'000'000;
// A frame is due every 33 ms.
constexpr std::int64_t kFrameLate_us = 150'000;
constexpr std::int64_t kColorMissing_us = 1'000'000;

std::int64_t now_us() noexcept { return MonotonicClock().now_us(); }

}  // namespace

bool launch_on_own_thread(std::function<void()> task) {
  try {
    std::thread(std::move(task)).detach();
  } catch (const std::system_error&) {
    return false;
  }
  return true;
}

bool launch_session_on_own_thread(DeviceSession* session) {
  return launch_on_own_thread([session] { session->run(); });
}

LiveCamera::LiveCamera(LiveDriver driver)
    : driver_(std::move(driver)), shared_(new Shared), serial_(driver_.serial) {}

LiveCamera::~LiveCamera() { close(); }

Result<CameraInfo> LiveCamera::open() {
  if (open_.load()) return info_;
  close();
  closing_.store(false);
  has_answer_.store(false);
  answer_.store(Code::SensorHealthy);
  serial_ = driver_.serial;
  try {
    keeper_ = std::thread([this] { keep(); });
  } catch (const std::system_error& error) {
    set_problem(error.what());
    return Error{Code::InternalFault, Stage::Capture, error.code().value()};
  }
  const std::int64_t until_us = now_us() + kAnswer_us;
  while (!has_answer_.load() && now_us() < until_us) {
    answered_.wait(answered_.version(), kLook_us);
  }
  const Code answer = has_answer_.load() ? answer_.load() : Code::NoFrameInTime;
  if (answer != Code::SensorHealthy) {
    close();
    return Error{answer, Stage::Capture, 0};
  }
  open_.store(true);
  return info_;
}

Status LiveCamera::start(FramePool& pool, const CaptureHooks& hooks) {
  if (!open_.load()) return Error{Code::SensorNotConnected, Stage::Capture, 0};
  if (started_.load()) return Error{Code::Busy, Stage::Capture, 0};
  if (pool.max_width() < info_.intrinsics.width || pool.max_height() < info_.intrinsics.height) {
    return Error{Code::BadParameter, Stage::Capture, 0};
  }
  pool_ = &pool;
  hooks_ = hooks;
  stopping_.store(false);
  health_.store(Code::SensorHealthy);
  last_frame_us_.store(0);
  last_color_us_ = now_us();
  timer_->pause();
  while (FrameExchange::Slot* const stale = shared_->frames->take()) {
    shared_->frames->release(stale);
  }
  try {
    capture_ = std::thread([this] { capture(); });
  } catch (const std::system_error& error) {
    set_problem(error.what());
    return Error{Code::InternalFault, Stage::Capture, error.code().value()};
  }
  started_.store(true);
  shared_->ended.store(false);
  shared_->stream.store(true);
  return {};
}

void LiveCamera::stop() noexcept {
  if (!capture_.joinable()) return;
  shared_->stream.store(false);
  stopping_.store(true);
  shared_->frames->wake();
  capture_.join();
  started_.store(false);
  pool_ = nullptr;
}

void LiveCamera::close() noexcept {
  stop();
  closing_.store(true);
  shared_->changed.notify();
  if (keeper_.joinable()) keeper_.join();
  open_.store(false);
}

CameraStatus LiveCamera::status() const noexcept {
  CameraStatus status;
  const bool up = link_up();
  if (open_.load()) {
    status.state = CameraState::Opened;
    if (started_.load()) status.state = up ? CameraState::Streaming : CameraState::Lost;
    if (started_.load() && up && shared_->ended.load()) status.state = CameraState::Ended;
    status.code = up ? health_.load() : lost_code_.load();
  }
  status.counters.frames = frames_.load(std::memory_order_relaxed);
  status.counters.dropped = dropped_.load(std::memory_order_relaxed);
  status.counters.lost_packets = lost_packets_.load(std::memory_order_relaxed);
  status.counters.reconnects = reconnects_.load(std::memory_order_relaxed);
  for (std::size_t i = 0; i < 3; ++i) status.gravity[i] = gravity_[i].load();
  return status;
}

std::string LiveCamera::problem() const {
  const std::lock_guard lock(problem_mutex_);
  return problem_;
}

void LiveCamera::set_problem(std::string text) {
  const std::lock_guard lock(problem_mutex_);
  problem_ = std::move(text);
}

void LiveCamera::capture() noexcept {
  if (hooks_.thread_started != nullptr) hooks_.thread_started(hooks_.context);
  FrameExchange& exchange = *shared_->frames;
  while (!stopping_.load()) {
    const std::uint32_t seen = exchange.arrived().version();
    FrameExchange::Slot* const slot = exchange.take();
    if (slot != nullptr) {
      if (slot->stamp.generation > lost_generation_.load()) deliver(*slot);
      exchange.release(slot);
    }
    if (hooks_.progress != nullptr) hooks_.progress(hooks_.context);
    if (slot != nullptr) continue;
    const std::int64_t last_us = last_frame_us_.load();
    const bool due = last_us != 0 && !shared_->ended.load();
    if (due && now_us() - last_us > kFrameLate_us) health_.store(Code::NoFrameInTime);
    exchange.arrived().wait(seen, kIdle_us);
  }
}

void LiveCamera::deliver(const FrameExchange::Slot& slot) noexcept {
  const FrameTime time = timer_->next(slot.stamp);
  const std::uint64_t up = up_generation_.load();
  if (slot.stamp.generation > up) {
    up_generation_.store(slot.stamp.generation);
    reconnects_.fetch_add(1, std::memory_order_relaxed);
  }
  last_frame_us_.store(now_us());
  watch_health(slot.has_color, time.clock_fault);
  if (time.missed != 0) count_dropped(time.missed);
  publish(slot, time);
}

void LiveCamera::watch_health(bool has_color, bool clock_fault) noexcept {
  if (has_color) last_color_us_ = last_frame_us_.load();
  const bool colorless =
      info_.has_color && last_frame_us_.load() - last_color_us_ > kColorMissing_us;
  Code code = colorless ? Code::ColorMissing : Code::SensorHealthy;
  if (clock_fault) code = Code::ClockFault;
  health_.store(code);
}

void LiveCamera::publish(const FrameExchange::Slot& slot, const FrameTime& time) noexcept {
  FramePool::Slot* const out = pool_->begin_write();
  if (out == nullptr) return count_dropped(1);
  DepthFrame frame;
  std::copy(slot.depth.begin(), slot.depth.end(), out->depth);
  frame.depth = {out->depth, info_.intrinsics.width, info_.intrinsics.height};
  if (slot.has_color && out->color != nullptr) {
    std::copy(slot.color.begin(), slot.color.end(), out->color);
    frame.color = {out->color, info_.intrinsics.width, info_.intrinsics.height};
  }
  frame.metres_per_unit = info_.metres_per_unit;
  frame.intrinsics = info_.intrinsics;
  frame.baseline_m = info_.baseline_m;
  frame.exposure_us = time.exposure_us;
  frame.device_us = time.device_us;
  frame.sequence = time.sequence;
  frame.lost_packets = slot.stamp.lost_packets;
  frame.recorded = !info_.live;
  out->frame = frame;
  frames_.fetch_add(1, std::memory_order_relaxed);
  lost_packets_.fetch_add(frame.lost_packets, std::memory_order_relaxed);
  pool_->publish(out);
}

void LiveCamera::count_dropped(std::uint64_t frames) noexcept {
  dropped_.fetch_add(frames, std::memory_order_relaxed);
  pool_->count_drop(frames);
}

}  // namespace grapnel
