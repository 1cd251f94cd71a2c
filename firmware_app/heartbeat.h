#pragma once

#include <array>
#include <cstdint>

#include "firmware_app/camera_keeper.h"
#include "firmware_app/crash_record.h"
#include "firmware_app/job.h"
#include "firmware_app/journal.h"
#include "firmware_app/notify.h"
#include "firmware_app/registration_loop.h"
#include "firmware_app/sensor_health.h"
#include "firmware_app/supervisor.h"
#include "firmware_app/thread_account.h"
#include "hal/frame_pool.h"

namespace grapnel {

/// Gathers how the appliance is, ten times a second, for the field bus, the service manager and the
/// watchdog. Called by housekeeping alone.
class Heartbeat {
 public:
  struct Parts {
    Exchange* exchange = nullptr;
    Journal* journal = nullptr;
    const ServiceNotifier* notifier = nullptr;
    Supervisor* supervisor = nullptr;
    CrashReporter* crash = nullptr;
    FramePool* pool = nullptr;
    CameraKeeper* camera = nullptr;
    SensorHealth* sensor = nullptr;
    RegistrationLoop* registration = nullptr;
    std::array<ThreadAccount*, 3> accounts{};  ///< of the real-time threads
  };

  /// `memory_missing`: memory was to be locked and could not be.
  Heartbeat(Parts parts, bool memory_missing, std::int64_t now_us)
      : parts_(parts), memory_missing_(memory_missing), started_us_(now_us) {}

  /// One round, published when it is due. True when the appliance came up with it: every part is
  /// there, or the camera has had its time; heap calls and page faults count from then on.
  [[nodiscard]] bool beat(std::int64_t now_us);

 private:
  [[nodiscard]] bool came_up(std::int64_t now_us);
  void look_at_threads(std::int64_t now_us);
  void look_at_camera(std::int64_t now_us);
  void count_accounts() noexcept;
  void say_status(std::int64_t now_us);

  Parts parts_;
  bool memory_missing_;
  std::int64_t started_us_;
  Health health_;
  std::int64_t next_beat_us_ = 0;
  std::int64_t next_watchdog_us_ = 0;
  std::int64_t next_status_us_ = 0;
  std::int64_t next_look_us_ = 0;
  Supervised told_silent_ = Supervised::kCount;
};

}  // namespace grapnel
