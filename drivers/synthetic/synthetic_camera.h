#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "base/clock.h"
#include "base/config.h"
#include "base/signal.h"
#include "drivers/synthetic/fault_script.h"
#include "drivers/synthetic/render_ahead.h"
#include "drivers/synthetic/scene.h"
#include "drivers/synthetic/synthetic_options.h"
#include "hal/camera.h"

namespace grapnel {

/// A scene as if it were a camera, with the scene's scripted faults. Frame times count from open()
/// on, over restarts and rounds of the scene; faults are scripted in them and so happen once.
/// Exposure is the frame's due time (true time) or the moment of publication (fast); a frame over
/// 0.25 s late in true time is left out and counted as dropped. device_us is a 60 MHz counter of
/// 32 bits, unwrapped.
class SyntheticCamera final : public Camera {
 public:
  /// `clock` outlives the camera.
  SyntheticCamera(SyntheticOptions options, const Clock& clock);
  ~SyntheticCamera() override;

  Result<CameraInfo> open() override;
  Status start(FramePool& pool, const CaptureHooks& hooks) override;
  void stop() noexcept override;
  void close() noexcept override;
  [[nodiscard]] CameraStatus status() const noexcept override;
  [[nodiscard]] std::string problem() const override;

  /// Take the sensor away and give it back, from any thread: as the script's Disconnect does.
  void unplug() noexcept { unplugged_.store(true); }
  void replug() noexcept { unplugged_.store(false); }

 private:
  void capture() noexcept;
  /// False when stop() came first.
  bool wait_until_due(const RenderedFrame& rendered) noexcept;
  void deliver(const RenderedFrame& rendered) noexcept;
  /// Follows the sensor's going and coming. True when the frame arrives.
  bool arrives(const RenderedFrame& rendered) noexcept;
  void publish(const RenderedFrame& rendered) noexcept;
  void count_dropped() noexcept;
  void idle(std::uint32_t seen, std::int64_t limit_us) noexcept;
  [[nodiscard]] std::int64_t scene_time_us(std::uint64_t n) const noexcept;
  [[nodiscard]] std::int64_t due_us(std::uint64_t n) const noexcept;
  void set_state(CameraState state, Code code) noexcept;
  void set_problem(std::string text);

  const SyntheticOptions options_;
  const Clock& clock_;
  std::unique_ptr<Scene> scene_;
  std::unique_ptr<RenderAhead> renderer_;

  FramePool* pool_ = nullptr;
  CaptureHooks hooks_{};
  std::thread thread_;
  Signal changed_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> unplugged_{false};

  // Capture thread, and the owner between two runs.
  std::int64_t start_us_ = 0;  // when frame time first_n_ is due; 0: not begun
  std::uint64_t first_n_ = 0;
  std::uint64_t next_n_ = 0;
  std::uint64_t end_n_ = 0;
  std::uint64_t sequence_ = 0;
  std::int64_t last_exposure_us_ = 0;
  TickUnwrapper device_clock_;

  std::atomic<std::uint64_t> frames_{0};
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<std::uint64_t> lost_packets_{0};
  std::atomic<std::uint64_t> reconnects_{0};
  std::atomic<CameraState> state_{CameraState::Closed};
  std::atomic<Code> code_{Code::SensorNotConnected};
  std::atomic<Code> failed_with_{Code::Ok};  // the last fault of the capture thread
  mutable std::mutex problem_mutex_;
  std::string problem_;
};

/// From the [camera] table. Throws InputError.
[[nodiscard]] std::unique_ptr<Camera> make_synthetic_camera(const ConfigTable& camera,
                                                            const Clock& clock);

}  // namespace grapnel
