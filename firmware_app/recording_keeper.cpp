#include "firmware_app/recording_keeper.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <system_error>
#include <utility>

#include "base/input_error.h"
#include "drivers/replay/wall_clock.h"

namespace grapnel {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kLookUs = 100'000;

std::uint32_t register_of(std::uint64_t count) noexcept {
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(count, 0xffffffffULL));
}

}  // namespace

RecordingKeeper::Running::Running(fs::path where, const RecordingKeeper& keeper)
    : folder(std::move(where)),
      store(folder),
      recorder(*keeper.parts_.pool, store, *keeper.parts_.clock, keeper.options()),
      began_us(keeper.parts_.clock->now_us()) {}

RecordingKeeper::RecordingKeeper(Parts parts, const RecordingSettings& settings, fs::path folder)
    : parts_(std::move(parts)), settings_(settings), folder_(std::move(folder)) {}

bool RecordingKeeper::start() {
  return thread_.start([](void* self) { static_cast<RecordingKeeper*>(self)->run(); }, this);
}

void RecordingKeeper::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  parts_.exchange->wake.notify();
  thread_.join();
}

void RecordingKeeper::run() {
  name_this_thread("recorder");
  for (;;) {
    const std::uint32_t seen = parts_.exchange->wake.version();
    const bool last = stop_.load(std::memory_order_acquire);
    step();
    if (last) break;
    parts_.exchange->wake.wait(seen, kLookUs);
  }
  end();
}

void RecordingKeeper::step() {
  parts_.exchange->request.update();
  const RecordRequest& request = parts_.exchange->request.get();
  if (request.number != state_.answered) answer(request);
  if (!running_) return;
  take_counters();
  parts_.exchange->state.publish(state_);
  const std::int64_t length_us = std::int64_t{settings_.max_seconds} * 1'000'000;
  const std::int64_t now_us = parts_.clock->now_us();
  if (settings_.max_seconds > 0 && now_us - running_->began_us >= length_us) end();
}

void RecordingKeeper::answer(const RecordRequest& request) {
  state_.answered = request.number;
  if (request.action == RecordAction::Begin) {
    state_.answer = running_ ? Code::Busy : begin(request.part_tag);
    parts_.exchange->state.publish(state_);
    return;
  }
  state_.answer = running_ ? Code::CaptureDone : Code::BadParameter;
  if (running_) {
    end();
  } else {
    parts_.exchange->state.publish(state_);
  }
}

RecorderOptions RecordingKeeper::options() const {
  constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;
  RecorderOptions options;
  options.color = settings_.color;
  options.jpeg_quality = settings_.jpeg_quality;
  options.serial = parts_.serial();
  options.time_offset_us = wall_clock_offset_us(*parts_.clock);
  options.queue_bytes = static_cast<std::size_t>(settings_.queue_mb) * kMiB;
  options.min_free_bytes = static_cast<std::uint64_t>(settings_.min_free_mb) * kMiB;
  return options;
}

/// The folder's highest number and one more, so that names sort by age.
fs::path RecordingKeeper::next_folder(std::uint32_t part_tag) const {
  unsigned long highest = 0;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, none)) {
    highest = std::max(highest, std::strtoul(entry.path().filename().c_str(), nullptr, 10));
  }
  char name[48] = {};
  std::snprintf(name, sizeof name, "%08lu-tag%08x", highest + 1, static_cast<unsigned>(part_tag));
  return folder_ / name;
}

Code RecordingKeeper::begin(std::uint32_t part_tag) {
  try {
    std::error_code error;
    fs::create_directories(folder_, error);
    const std::uint64_t min_free = options().min_free_bytes;
    const fs::space_info space = fs::space(folder_, error);
    if (error) throw InputError(folder_.string() + ": " + error.message());
    if (space.available < min_free) {
      throw InputError(folder_.string() + ": disk full: less than " +
                       std::to_string(min_free >> 20) + " MiB are free (recording.min_free_mb)");
    }
    running_.emplace(next_folder(part_tag), *this);
    running_->recorder.start();
  } catch (const std::exception& problem) {
    running_.reset();
    parts_.say(LogLevel::Warning, std::string("no recording: ") + problem.what());
    return Code::DiskFull;
  }
  told_.clear();
  state_.phase = PlcRecording::Running;
  take_counters();
  parts_.say(LogLevel::Info, "recording into " + running_->folder.string());
  return Code::CaptureDone;
}

void RecordingKeeper::take_counters() {
  const RecorderCounters counters = running_->recorder.counters();
  state_.frames = register_of(counters.recorded);
  state_.missed = register_of(counters.missed);
  state_.dropped = register_of(counters.dropped_disk);
  state_.failing = counters.failing;
  const std::string problem = running_->recorder.problem();
  if (!problem.empty() && problem != told_) {
    parts_.say(LogLevel::Warning, "recording: " + problem);
    told_ = problem;
  }
}

void RecordingKeeper::end() {
  if (!running_) return;
  state_.phase = PlcRecording::Ending;
  parts_.exchange->state.publish(state_);
  running_->recorder.stop();
  take_counters();
  parts_.say(LogLevel::Info, "recorded " + running_->folder.string() + ": " +
                                 std::to_string(state_.frames) + " frames, " +
                                 std::to_string(state_.missed) + " missed, " +
                                 std::to_string(state_.dropped) + " dropped by the disk");
  running_.reset();
  state_.phase = PlcRecording::None;
  state_.failing = false;
  parts_.exchange->state.publish(state_);
}

}  // namespace grapnel
