#include "drivers/synthetic/synthetic_camera.h"

#include <algorithm>
#include <exception>
#include <limits>
#include <system_error>
#include <utility>

#include "base/code.h"

namespace grapnel {
namespace {

// Half of what the owner of the hooks is promised.
constexpr std::int64_t kIdle_us = 50'000;
constexpr std::int64_t kTooLate_us = 250'000;

}  // namespace

SyntheticCamera::SyntheticCamera(SyntheticOptions options, const Clock& clock)
    : options_(std::move(options)), clock_(clock) {}

SyntheticCamera::~SyntheticCamera() { close(); }

Result<CameraInfo> SyntheticCamera::open() {
  if (!scene_) {
    try {
      scene_ = std::make_unique<Scene>(load_scene(options_.scene));
      renderer_ = std::make_unique<RenderAhead>(*scene_);
    } catch (const std::exception& error) {
      close();
      set_problem(error.what());
      return Error{Code::SensorNotConnected, Stage::Capture, 0};
    }
    const std::string found = scene_->camera.serial;
    if (!options_.serial.empty() && options_.serial != found) {
      close();
      set_problem("serial " + options_.serial + " is wanted, " + found + " is there");
      return Error{Code::WrongSerial, Stage::Capture, 0};
    }
    next_n_ = 0;
    end_n_ = options_.loop ? std::numeric_limits<std::uint64_t>::max()
                           : static_cast<std::uint64_t>(scene_->frames);
    device_clock_ = {};
    set_state(CameraState::Opened, Code::SensorHealthy);
  }
  CameraInfo info;
  info.driver = "synthetic";
  info.model = "scene " + scene_->name;
  info.serial = scene_->camera.serial;
  info.intrinsics = scene_->camera.intrinsics();
  info.metres_per_unit = scene_->camera.metres_per_unit;
  info.baseline_m = scene_->camera.baseline_m;
  info.nominal_rate_hz = scene_->rate_hz;
  info.has_color = scene_->camera.color;
  info.live = false;
  return info;
}

Status SyntheticCamera::start(FramePool& pool, const CaptureHooks& hooks) {
  if (!scene_) return Error{Code::SensorNotConnected, Stage::Capture, 0};
  const bool ended = state_.load() == CameraState::Ended;
  if (thread_.joinable() && !ended) return Error{Code::Busy, Stage::Capture, 0};
  if (pool.max_width() < scene_->camera.width || pool.max_height() < scene_->camera.height) {
    return Error{Code::BadParameter, Stage::Capture, 0};
  }
  stop();
  if (next_n_ == end_n_) end_n_ += static_cast<std::uint64_t>(scene_->frames);
  pool_ = &pool;
  hooks_ = hooks;
  stop_.store(false);
  start_us_ = 0;
  first_n_ = next_n_;
  set_state(CameraState::Streaming, Code::SensorHealthy);
  try {
    renderer_->start(first_n_, end_n_, changed_);
    thread_ = std::thread([this] { capture(); });
  } catch (const std::system_error& error) {
    renderer_->stop();
    set_state(CameraState::Opened, Code::InternalFault);
    set_problem(error.what());
    return Error{Code::InternalFault, Stage::Capture, error.code().value()};
  }
  return {};
}

void SyntheticCamera::stop() noexcept {
  if (!thread_.joinable()) return;
  stop_.store(true);
  changed_.notify();
  thread_.join();
  renderer_->stop();
  pool_ = nullptr;
  set_state(CameraState::Opened, Code::SensorHealthy);
}

void SyntheticCamera::close() noexcept {
  stop();
  renderer_.reset();
  scene_.reset();
  set_state(CameraState::Closed, Code::SensorNotConnected);
}

CameraStatus SyntheticCamera::status() const noexcept {
  CameraStatus status;
  status.state = state_.load();
  status.code = code_.load();
  status.counters.frames = frames_.load(std::memory_order_relaxed);
  status.counters.dropped = dropped_.load(std::memory_order_relaxed);
  status.counters.lost_packets = lost_packets_.load(std::memory_order_relaxed);
  status.counters.reconnects = reconnects_.load(std::memory_order_relaxed);
  return status;
}

std::string SyntheticCamera::problem() const {
  const Code failed = failed_with_.load();
  if (failed == Code::WrongSerial) return "after a disconnection another unit answered";
  if (failed == Code::SensorNotConnected) return "the sensor was disconnected";
  const std::lock_guard lock(problem_mutex_);
  return problem_;
}

void SyntheticCamera::set_problem(std::string text) {
  failed_with_.store(Code::Ok);
  const std::lock_guard lock(problem_mutex_);
  problem_ = std::move(text);
}

void SyntheticCamera::set_state(CameraState state, Code code) noexcept {
  code_.store(code);
  state_.store(state);
}

std::int64_t SyntheticCamera::scene_time_us(std::uint64_t n) const noexcept {
  return static_cast<std::int64_t>(static_cast<double>(n) * 1e6 / scene_->rate_hz + 0.5);
}

std::int64_t SyntheticCamera::due_us(std::uint64_t n) const noexcept {
  return start_us_ + scene_time_us(n) - scene_time_us(first_n_);
}

void SyntheticCamera::capture() noexcept {
  if (hooks_.thread_started != nullptr) hooks_.thread_started(hooks_.context);
  while (!stop_.load()) {
    const std::uint32_t seen = changed_.version();
    const RenderedFrame* const rendered =
        state_.load() == CameraState::Ended ? nullptr : renderer_->front();
    if (rendered == nullptr) {
      idle(seen, kIdle_us);
      continue;
    }
    if (start_us_ == 0) start_us_ = std::max(clock_.now_us(), last_exposure_us_ + 1);
    if (!wait_until_due(*rendered)) break;
    deliver(*rendered);
    renderer_->pop();
    if (hooks_.progress != nullptr) hooks_.progress(hooks_.context);
  }
}

void SyntheticCamera::idle(std::uint32_t seen, std::int64_t limit_us) noexcept {
  if (hooks_.progress != nullptr) hooks_.progress(hooks_.context);
  changed_.wait(seen, std::min(limit_us, kIdle_us));
}

bool SyntheticCamera::wait_until_due(const RenderedFrame& rendered) noexcept {
  if (options_.mode == SyntheticPace::Fast || rendered.end) return true;
  while (!stop_.load()) {
    const std::uint32_t seen = changed_.version();
    const std::int64_t wait_us = due_us(rendered.n) - clock_.now_us();
    if (wait_us <= 0) return true;
    idle(seen, wait_us);
  }
  return false;
}

void SyntheticCamera::deliver(const RenderedFrame& rendered) noexcept {
  if (rendered.end) return set_state(CameraState::Ended, Code::NoFrameInTime);
  next_n_ = rendered.n + 1;
  if (!arrives(rendered)) return;
  const bool late = options_.mode == SyntheticPace::TrueTime &&
                    due_us(rendered.n) + kTooLate_us < clock_.now_us();
  if (late) {
    count_dropped();
  } else {
    publish(rendered);
  }
  ++sequence_;
}

bool SyntheticCamera::arrives(const RenderedFrame& rendered) noexcept {
  const FrameFaults& faults = rendered.faults;
  if (faults.lost || unplugged_.load()) {
    const Code code = faults.wrong_serial ? Code::WrongSerial : Code::SensorNotConnected;
    failed_with_.store(code);
    set_state(CameraState::Lost, code);
    return false;
  }
  if (state_.load() == CameraState::Lost) reconnects_.fetch_add(1, std::memory_order_relaxed);
  set_state(CameraState::Streaming, faults.missing ? Code::NoFrameInTime : Code::SensorHealthy);
  if (faults.dropped) {
    count_dropped();
    ++sequence_;
    return false;
  }
  return !faults.missing;
}

void SyntheticCamera::publish(const RenderedFrame& rendered) noexcept {
  FramePool::Slot* const slot = pool_->begin_write();
  if (slot == nullptr) return count_dropped();
  const SceneCamera& camera = scene_->camera;
  DepthFrame frame;
  std::copy(rendered.depth.begin(), rendered.depth.end(), slot->depth);
  frame.depth = {slot->depth, camera.width, camera.height};
  if (!rendered.color.empty() && slot->color != nullptr) {
    std::copy(rendered.color.begin(), rendered.color.end(), slot->color);
    frame.color = {slot->color, camera.width, camera.height};
  }
  frame.metres_per_unit = camera.metres_per_unit;
  frame.intrinsics = camera.intrinsics();
  frame.baseline_m = camera.baseline_m;
  const bool paced = options_.mode == SyntheticPace::TrueTime;
  frame.exposure_us = std::max(paced ? due_us(rendered.n) : clock_.now_us(), last_exposure_us_ + 1);
  frame.device_us = device_clock_.time_us(
      device_ticks(scene_->faults, scene_->rate_hz, scene_time_us(rendered.n)));
  frame.sequence = sequence_;
  frame.lost_packets = rendered.faults.torn ? kTornPackets : 0;
  frame.recorded = true;
  last_exposure_us_ = frame.exposure_us;
  slot->frame = frame;
  frames_.fetch_add(1, std::memory_order_relaxed);
  lost_packets_.fetch_add(frame.lost_packets, std::memory_order_relaxed);
  pool_->publish(slot);
}

void SyntheticCamera::count_dropped() noexcept {
  dropped_.fetch_add(1, std::memory_order_relaxed);
  pool_->count_drop(1);
}

std::unique_ptr<Camera> make_synthetic_camera(const ConfigTable& camera, const Clock& clock) {
  return std::make_unique<SyntheticCamera>(read_synthetic_options(camera), clock);
}

}  // namespace grapnel
