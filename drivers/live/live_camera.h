#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "drivers/live/device_session.h"
#include "drivers/live/frame_timer.h"
#include "hal/camera.h"

namespace grapnel {

/// What makes a live camera out of a capture library.
struct LiveDriver {
  std::function<std::unique_ptr<SensorDevice>()> make_device;
  DeviceSession::Launch launch = nullptr;
  /// A hung session may be left behind and another opened beside it. False where the library
  /// endures one thread only: then a hung call must return before the device comes back.
  bool replaceable = true;
  std::string serial;           ///< the unit to open, "" any
  std::int64_t latency_us = 0;  ///< from mid-exposure to the device's time stamp
};

/// A camera behind a capture library that may hang, crash its streams or lose its device. Three
/// threads: the device's own makes the library's calls; the keeper watches it, re-opens the same
/// serial with a growing pause, and gives up calls that do not return; the capture thread stamps
/// finished frames and publishes them, and neither allocates nor waits for a lock.
class LiveCamera final : public Camera {
 public:
  explicit LiveCamera(LiveDriver driver);
  LiveCamera(const LiveCamera&) = delete;
  LiveCamera& operator=(const LiveCamera&) = delete;
  ~LiveCamera() override;

  Result<CameraInfo> open() override;
  Status start(FramePool& pool, const CaptureHooks& hooks) override;
  void stop() noexcept override;
  void close() noexcept override;
  [[nodiscard]] CameraStatus status() const noexcept override;
  [[nodiscard]] std::string problem() const override;

 private:
  /// What sessions use; it outlives the camera while one of them hangs.
  struct Shared final : DeviceSession::Orders {
    std::unique_ptr<FrameExchange> frames;
  };
  struct LeaveShared {
    void operator()(Shared* shared) const noexcept { shared->leave(); }
  };

  // Keeper thread.
  void keep();
  [[nodiscard]] DeviceSession* launch_session();
  void watch(DeviceSession& session);
  /// The session has opened its device. False: it is not the one it was.
  [[nodiscard]] bool welcome(const DeviceSession& session);
  [[nodiscard]] bool frames_stopped(const DeviceSession& session, std::int64_t now_us) const;
  void take_gravity(const DeviceSession& session) noexcept;
  void lose(std::uint64_t generation, Code code, const std::string& problem);
  void announce(Code code);

  // Capture thread.
  void capture() noexcept;
  void deliver(const FrameExchange::Slot& slot) noexcept;
  void publish(const FrameExchange::Slot& slot, const FrameTime& time) noexcept;
  void watch_health(bool has_color, bool clock_fault) noexcept;
  void count_dropped(std::uint64_t frames) noexcept;

  [[nodiscard]] bool link_up() const noexcept {
    return up_generation_.load() > lost_generation_.load();
  }
  void set_problem(std::string text);

  const LiveDriver driver_;
  std::unique_ptr<Shared, LeaveShared> shared_;
  std::thread keeper_;
  std::thread capture_;
  FramePool* pool_ = nullptr;
  CaptureHooks hooks_{};
  std::optional<FrameTimer> timer_;
  CameraInfo info_;

  // Keeper, and the owner before it starts and after it ends.
  std::uint64_t generation_ = 0;
  std::string serial_;
  bool sense_ = true;

  Signal answered_;  // the first opening has succeeded or failed
  std::atomic<bool> has_answer_{false};
  std::atomic<Code> answer_{Code::SensorHealthy};
  std::atomic<bool> open_{false};
  std::atomic<bool> started_{false};
  std::atomic<bool> stopping_{false};
  std::atomic<bool> closing_{false};
  std::atomic<std::uint64_t> up_generation_{0};    // of the newest session that works
  std::atomic<std::uint64_t> lost_generation_{0};  // up to here all are gone
  std::atomic<Code> lost_code_{Code::SensorNotConnected};
  std::atomic<Code> health_{Code::SensorHealthy};
  std::atomic<std::int64_t> last_frame_us_{0};
  std::int64_t last_color_us_ = 0;
  std::array<std::atomic<float>, 3> gravity_{};

  std::atomic<std::uint64_t> frames_{0};
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<std::uint64_t> lost_packets_{0};
  std::atomic<std::uint64_t> reconnects_{0};
  mutable std::mutex problem_mutex_;
  std::string problem_;
};

/// Runs a task on a thread of its own that nobody waits for. False: there is none to be had.
[[nodiscard]] bool launch_on_own_thread(std::function<void()> task);
/// The same for a session.
[[nodiscard]] bool launch_session_on_own_thread(DeviceSession* session);

}  // namespace grapnel
