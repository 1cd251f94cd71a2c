#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>

#include "firmware_app/journal.h"
#include "firmware_app/realtime.h"
#include "firmware_app/supervisor.h"
#include "firmware_app/thread_account.h"
#include "hal/camera.h"
#include "hal/frame_pool.h"

namespace grapnel {

/// Owns the camera: opens it, starts it, and tries again while it is not there, on a thread of its
/// own, so that a driver that blocks holds nobody up.
class CameraKeeper {
 public:
  struct Parts {
    FramePool* pool = nullptr;
    Supervisor* supervisor = nullptr;
    ThreadAccount* account = nullptr;
    Journal* journal = nullptr;
    std::atomic<bool>* foreign_sensor = nullptr;
  };

  CameraKeeper(std::unique_ptr<Camera> camera, Parts parts, const Scheduling& scheduling,
               std::string calibrated_serial);
  CameraKeeper(const CameraKeeper&) = delete;
  CameraKeeper& operator=(const CameraKeeper&) = delete;
  ~CameraKeeper() { stop(); }

  [[nodiscard]] bool start();
  /// Stops the camera and joins the thread.
  void stop();

  [[nodiscard]] Camera& camera() const noexcept { return *camera_; }
  /// What the PLC is told: SensorHealthy, or the 20xx that says why not.
  [[nodiscard]] Code code() const noexcept;
  [[nodiscard]] bool live() const noexcept { return live_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::uint32_t serial_hash() const noexcept {
    return serial_hash_.load(std::memory_order_relaxed);
  }
  /// Of the camera opened last; "" before.
  [[nodiscard]] std::string serial() const;
  /// The capture thread did not get the scheduling that was asked for.
  [[nodiscard]] bool scheduling_refused() const noexcept {
    return scheduling_refused_.load(std::memory_order_relaxed);
  }

 private:
  void run();
  bool open_and_start();
  void on_capture_thread() noexcept;

  std::unique_ptr<Camera> camera_;
  Parts parts_;
  Scheduling scheduling_;
  std::string calibrated_serial_;
  Thread thread_;
  Signal wake_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> opening_{true};
  std::atomic<bool> too_large_{false};
  std::atomic<Code> refused_{Code::SensorHealthy};  // why the last opening failed
  std::atomic<bool> live_{true};
  std::atomic<std::uint32_t> serial_hash_{0};
  std::atomic<bool> scheduling_refused_{false};
  mutable std::mutex serial_mutex_;
  std::string serial_;
  std::string told_;  // last problem written, so that it is written once
};

}  // namespace grapnel
