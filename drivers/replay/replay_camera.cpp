#include "drivers/replay/replay_camera.h"

#include <algorithm>
#include <exception>
#include <system_error>
#include <utility>

#include "base/input_error.h"

namespace grapnel {
namespace {

// Half of what the owner of the hooks is promised.
constexpr std::int64_t kIdle_us = 50'000;
constexpr std::int64_t kTooLate_us = 250'000;
constexpr std::int64_t kStepLimit_us = 10'000'000;

}  // namespace

ReplayCamera::ReplayCamera(ReplayOptions options, const Clock& clock)
    : options_(std::move(options)), clock_(clock) {}

ReplayCamera::~ReplayCamera() { close(); }

Result<CameraInfo> ReplayCamera::open() {
  if (!recording_) {
    try {
      recording_ = Recording::open(options_.path);
      order_ = std::make_unique<PlaybackOrder>(*recording_, options_);
      decoder_ = std::make_unique<DecodeAhead>(*recording_, *order_);
      next_device_us_ = recording_->time_us(order_->frame(0));
    } catch (const std::exception& error) {
      close();
      set_problem(error.what());
      return Error{Code::SensorNotConnected, Stage::Recording, 0};
    }
    set_state(CameraState::Opened, Code::SensorHealthy);
  }
  const CameraFile& camera = recording_->camera();
  CameraInfo info;
  info.driver = "replay";
  info.model = "recording " + options_.path;
  info.serial = camera.serial;
  info.corrected = camera.corrects();
  info.intrinsics = camera.intrinsics();
  info.metres_per_unit = camera.metres_per_unit;
  info.baseline_m = camera.baseline_m;
  info.nominal_rate_hz = 1e6 / static_cast<double>(recording_->interval_us());
  info.has_color = recording_->has_color();
  info.live = false;
  return info;
}

Status ReplayCamera::start(FramePool& pool, const CaptureHooks& hooks) {
  if (!recording_) return Error{Code::SensorNotConnected, Stage::Capture, 0};
  if (state_.load() == CameraState::Streaming) return Error{Code::Busy, Stage::Capture, 0};
  const Intrinsics intrinsics = recording_->camera().intrinsics();
  if (pool.max_width() < intrinsics.width || pool.max_height() < intrinsics.height) {
    return Error{Code::BadParameter, Stage::Capture, 0};
  }
  stop();
  pool_ = &pool;
  hooks_ = hooks;
  stop_.store(false);
  start_us_.store(0);
  steps_wanted_.store(0);
  steps_done_.store(0);
  sequence_base_ = next_sequence_;
  device_base_us_ = next_device_us_;
  set_state(CameraState::Streaming, Code::SensorHealthy);
  const auto too_late = [this](std::uint64_t n) {
    const bool paced = options_.mode == ReplayMode::TrueTime && start_us_.load() != 0;
    return paced && due_us(n) + kTooLate_us < clock_.now_us();
  };
  const auto on_problem = [this](const std::string& text) { set_problem(text); };
  try {
    decoder_->start(options_.on_bad_frame, {too_late, on_problem}, changed_);
    thread_ = std::thread([this] { capture(); });
  } catch (const std::system_error& error) {
    decoder_->stop();
    set_state(CameraState::Opened, Code::InternalFault);
    set_problem(error.what());
    return Error{Code::InternalFault, Stage::Capture, error.code().value()};
  }
  return {};
}

void ReplayCamera::stop() noexcept {
  if (!thread_.joinable()) return;
  stop_.store(true);
  changed_.notify();
  thread_.join();
  decoder_->stop();
  pool_ = nullptr;
  set_state(CameraState::Opened, Code::SensorHealthy);
}

void ReplayCamera::close() noexcept {
  stop();
  decoder_.reset();
  order_.reset();
  recording_.reset();
  set_state(CameraState::Closed, Code::SensorNotConnected);
}

CameraStatus ReplayCamera::status() const noexcept {
  CameraStatus status;
  status.state = state_.load();
  status.code = code_.load();
  status.counters.frames = counters_.frames.load(std::memory_order_relaxed);
  status.counters.dropped = counters_.dropped.load(std::memory_order_relaxed);
  status.counters.bad_frames = counters_.bad_frames.load(std::memory_order_relaxed);
  return status;
}

std::string ReplayCamera::problem() const {
  const std::lock_guard lock(problem_mutex_);
  return problem_;
}

void ReplayCamera::set_problem(std::string text) {
  const std::lock_guard lock(problem_mutex_);
  problem_ = std::move(text);
}

void ReplayCamera::set_state(CameraState state, Code code) noexcept {
  code_.store(code);
  state_.store(state);
}

void ReplayCamera::request_frame() noexcept {
  steps_wanted_.fetch_add(1);
  changed_.notify();
}

bool ReplayCamera::step() noexcept {
  const std::uint64_t frames = counters_.frames.load();
  const std::uint64_t target = steps_wanted_.fetch_add(1) + 1;
  const MonotonicClock real_time;
  const std::int64_t limit_us = real_time.now_us() + kStepLimit_us;
  changed_.notify();
  while (steps_done_.load() < target && state_.load() == CameraState::Streaming) {
    const std::uint32_t seen = changed_.version();
    if (steps_done_.load() >= target || real_time.now_us() >= limit_us) break;
    changed_.wait(seen, kIdle_us);
  }
  return counters_.frames.load() > frames;
}

std::int64_t ReplayCamera::due_us(std::uint64_t n) const noexcept {
  const auto offset_us = static_cast<double>(order_->offset_us(n)) / options_.factor;
  return start_us_.load() + static_cast<std::int64_t>(offset_us);
}

void ReplayCamera::capture() noexcept {
  if (hooks_.thread_started != nullptr) hooks_.thread_started(hooks_.context);
  while (!stop_.load()) {
    const std::uint32_t seen = changed_.version();
    const DecodedFrame* decoded =
        state_.load() == CameraState::Streaming ? decoder_->front() : nullptr;
    if (decoded == nullptr) {
      idle(seen, kIdle_us);
      continue;
    }
    if (start_us_.load() == 0) start_us_.store(std::max(clock_.now_us(), last_exposure_us_ + 1));
    if (!wait_until_due(*decoded)) break;
    deliver(*decoded);
    decoder_->pop();
    steps_done_.fetch_add(1);
    changed_.notify();
    if (hooks_.progress != nullptr) hooks_.progress(hooks_.context);
  }
}

void ReplayCamera::idle(std::uint32_t seen, std::int64_t limit_us) noexcept {
  if (hooks_.progress != nullptr) hooks_.progress(hooks_.context);
  changed_.wait(seen, std::min(limit_us, kIdle_us));
}

bool ReplayCamera::wait_until_due(const DecodedFrame& decoded) noexcept {
  const bool last = decoded.kind == DecodedFrame::Kind::End;
  while (!stop_.load()) {
    const std::uint32_t seen = changed_.version();
    std::int64_t wait_us = 0;
    if (options_.mode == ReplayMode::TrueTime && !last) {
      wait_us = due_us(decoded.n) - clock_.now_us();
    } else if (options_.mode == ReplayMode::Stepped && steps_wanted_.load() <= steps_done_.load()) {
      wait_us = kIdle_us;
    }
    if (wait_us <= 0) return true;
    idle(seen, wait_us);
  }
  return false;
}

void ReplayCamera::deliver(const DecodedFrame& decoded) noexcept {
  count_dropped(decoded.skipped);
  switch (decoded.kind) {
    case DecodedFrame::Kind::Frame:
      publish(decoded);
      break;
    case DecodedFrame::Kind::Bad:
      counters_.bad_frames.fetch_add(1, std::memory_order_relaxed);
      count_dropped(1);
      break;
    case DecodedFrame::Kind::End:
      set_state(CameraState::Ended, Code::NoFrameInTime);
      return;
    case DecodedFrame::Kind::Failed:
      set_state(CameraState::Ended, Code::SensorNotConnected);
      return;
  }
  next_sequence_ = sequence_base_ + decoded.n + 1;
  next_device_us_ = device_base_us_ + order_->offset_us(decoded.n) + recording_->interval_us();
}

void ReplayCamera::publish(const DecodedFrame& decoded) noexcept {
  FramePool::Slot* const slot = pool_->begin_write();
  if (slot == nullptr) return count_dropped(1);
  const CameraFile& camera = recording_->camera();
  DepthFrame frame;
  std::copy(decoded.depth.begin(), decoded.depth.end(), slot->depth);
  frame.depth = {slot->depth, camera.width, camera.height};
  if (decoded.has_color && slot->color != nullptr) {
    std::copy(decoded.color.begin(), decoded.color.end(), slot->color);
    frame.color = {slot->color, camera.width, camera.height};
  }
  frame.metres_per_unit = camera.metres_per_unit;
  frame.intrinsics = camera.intrinsics();
  frame.baseline_m = camera.baseline_m;
  const std::int64_t exposure_us =
      options_.mode == ReplayMode::TrueTime ? due_us(decoded.n) : clock_.now_us();
  frame.exposure_us = std::max(exposure_us, last_exposure_us_ + 1);
  frame.device_us = device_base_us_ + order_->offset_us(decoded.n);
  frame.sequence = sequence_base_ + decoded.n;
  frame.recorded = true;
  frame.corrected = camera.corrects();
  last_exposure_us_ = frame.exposure_us;
  slot->frame = frame;
  counters_.frames.fetch_add(1, std::memory_order_relaxed);
  pool_->publish(slot);
}

void ReplayCamera::count_dropped(std::uint64_t frames) noexcept {
  if (frames == 0) return;
  counters_.dropped.fetch_add(frames, std::memory_order_relaxed);
  pool_->count_drop(frames);
}

std::unique_ptr<Camera> make_replay_camera(const ConfigTable& camera, const Clock& clock) {
  return std::make_unique<ReplayCamera>(read_replay_options(camera), clock);
}

}  // namespace grapnel
