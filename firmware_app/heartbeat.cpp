#include "firmware_app/heartbeat.h"

#include <algorithm>
#include <cstddef>
#include <string>

namespace grapnel {
namespace {

constexpr std::int64_t kBeatUs = 100'000;
constexpr std::int64_t kStatusUs = 5'000'000;
constexpr std::int64_t kLookUs = 1'000'000;
// A camera that opens within this time is there when the daemon says READY.
constexpr std::int64_t kCameraStartUs = 5'000'000;
constexpr double kMdegPerRad = 57295.779513082320;
constexpr double kUmPerMetre = 1e6;

std::int32_t whole(double value) noexcept {
  return static_cast<std::int32_t>(std::clamp(value, -2147483647.0, 2147483647.0));
}

}  // namespace

bool Heartbeat::beat(std::int64_t now_us) {
  if (now_us < next_beat_us_) return false;
  next_beat_us_ = now_us + kBeatUs;
  const bool up = came_up(now_us);
  look_at_threads(now_us);
  look_at_camera(now_us);
  count_accounts();
  parts_.exchange->health.publish(health_);
  say_status(now_us);
  return up;
}

bool Heartbeat::came_up(std::int64_t now_us) {
  if (health_.started) return false;
  const CameraKeeper& camera = *parts_.camera;
  const bool healthy = parts_.sensor->fault_of(camera.code()) == Code::SensorHealthy;
  const bool camera_up = healthy && (parts_.pool->published() > 0 || camera.camera().stepped());
  if (!camera_up && now_us < started_us_ + kCameraStartUs) return false;
  health_.started = true;
  for (ThreadAccount* account : parts_.accounts) account->restart();
  return true;
}

void Heartbeat::look_at_threads(std::int64_t now_us) {
  Supervisor& supervisor = *parts_.supervisor;
  const bool alive = supervisor.alive(now_us);
  parts_.crash->set_stalled(!alive);
  if (alive) ++health_.heartbeat;
  if (supervisor.silent() != told_silent_) {
    told_silent_ = supervisor.silent();
    static constexpr const char* kNames[] = {"capture", "registration", "field bus"};
    if (!alive) {
      parts_.journal->write(LogLevel::Fault, std::string("the ") +
                                                 kNames[static_cast<std::size_t>(told_silent_)] +
                                                 " thread makes no progress");
    }
  }
  const std::int64_t watchdog_us = parts_.notifier->watchdog_interval_us();
  if (alive && watchdog_us > 0 && now_us >= next_watchdog_us_) {
    parts_.notifier->send("WATCHDOG=1");
    next_watchdog_us_ = now_us + watchdog_us / 4;
  }
}

void Heartbeat::look_at_camera(std::int64_t now_us) {
  const CameraKeeper& keeper = *parts_.camera;
  SensorHealth& sensor = *parts_.sensor;
  if (now_us >= next_look_us_) {
    next_look_us_ = now_us + kLookUs;
    const FrameLease lease = parts_.pool->lease_latest();
    if (lease.valid()) sensor.see(lease.frame());
  }
  const CameraStatus status = keeper.camera().status();
  health_.live = keeper.live();
  health_.sensor = sensor.judge(keeper.code(), status, health_.live, now_us);
  health_.tilt_mdeg = whole(sensor.tilt_rad() * kMdegPerRad);
  health_.belt_residual_um = whole(sensor.belt_drift().shift_m * kUmPerMetre);
  health_.foreign_sensor = parts_.exchange->job.foreign_sensor.load(std::memory_order_relaxed);
  health_.realtime_missing =
      memory_missing_ || keeper.scheduling_refused() || parts_.registration->scheduling_refused();
  health_.frames = static_cast<std::uint32_t>(status.counters.frames);
  health_.dropped_frames = static_cast<std::uint32_t>(status.counters.dropped);
  health_.lost_packets = static_cast<std::uint32_t>(status.counters.lost_packets);
  health_.reconnects = static_cast<std::uint32_t>(status.counters.reconnects);
  health_.serial_hash = keeper.serial_hash();
}

void Heartbeat::count_accounts() noexcept {
  health_.heap_calls = 0;
  health_.page_faults = 0;
  for (const ThreadAccount* account : parts_.accounts) {
    health_.heap_calls += account->heap_calls();
    health_.page_faults += account->page_faults();
  }
}

void Heartbeat::say_status(std::int64_t now_us) {
  if (now_us < next_status_us_) return;
  next_status_us_ = now_us + kStatusUs;
  parts_.notifier->send("STATUS=camera " + std::string(describe(health_.sensor).text) + ", " +
                        std::to_string(health_.frames) + " frames, " +
                        std::to_string(parts_.exchange->job.finished.load()) + " jobs");
}

}  // namespace grapnel
