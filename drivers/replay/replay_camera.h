#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "base/clock.h"
#include "base/config.h"
#include "base/signal.h"
#include "drivers/replay/decode_ahead.h"
#include "drivers/replay/playback_order.h"
#include "drivers/replay/recording.h"
#include "drivers/replay/replay_options.h"
#include "hal/camera.h"

namespace grapnel {

/// Plays a recording as if it were a camera. Exposure times are host monotonic: in true time the
/// recorded distances from the start on, else the moment of publication. A frame that is over
/// 0.25 s late in true time is left out and counted as dropped. device_us is the recorded time, and
/// runs on over laps and restarts, as does the sequence.
class ReplayCamera final : public Camera {
 public:
  /// `clock` outlives the camera.
  ReplayCamera(ReplayOptions options, const Clock& clock);
  ~ReplayCamera() override;

  Result<CameraInfo> open() override;
  Status start(FramePool& pool, const CaptureHooks& hooks) override;
  void stop() noexcept override;
  void close() noexcept override;
  [[nodiscard]] CameraStatus status() const noexcept override;
  [[nodiscard]] std::string problem() const override;

  [[nodiscard]] bool stepped() const noexcept override {
    return options_.mode == ReplayMode::Stepped;
  }
  void request_frame() noexcept override;

  /// Mode Stepped: hands out the next frame and waits for it. False when it was dropped or nothing
  /// followed.
  bool step() noexcept;

 private:
  struct Counters {
    std::atomic<std::uint64_t> frames{0};
    std::atomic<std::uint64_t> dropped{0};
    std::atomic<std::uint64_t> bad_frames{0};
  };

  void capture() noexcept;
  /// False when stop() came first.
  bool wait_until_due(const DecodedFrame& decoded) noexcept;
  void deliver(const DecodedFrame& decoded) noexcept;
  void publish(const DecodedFrame& decoded) noexcept;
  void count_dropped(std::uint64_t frames) noexcept;
  /// Waits for a change or at most some time, and lets the owner see progress.
  void idle(std::uint32_t seen, std::int64_t limit_us) noexcept;
  [[nodiscard]] std::int64_t due_us(std::uint64_t n) const noexcept;
  void set_state(CameraState state, Code code) noexcept;
  void set_problem(std::string text);

  const ReplayOptions options_;
  const Clock& clock_;
  std::optional<Recording> recording_;
  std::unique_ptr<PlaybackOrder> order_;
  std::unique_ptr<DecodeAhead> decoder_;

  FramePool* pool_ = nullptr;
  CaptureHooks hooks_{};
  std::thread thread_;
  Signal changed_;
  std::atomic<bool> stop_{false};
  std::atomic<std::int64_t> start_us_{0};  // 0: not begun
  std::atomic<std::uint64_t> steps_wanted_{0};
  std::atomic<std::uint64_t> steps_done_{0};

  // Capture thread, and the owner between two runs.
  std::uint64_t sequence_base_ = 0;
  std::int64_t device_base_us_ = 0;
  std::uint64_t next_sequence_ = 0;
  std::int64_t next_device_us_ = 0;
  std::int64_t last_exposure_us_ = 0;

  Counters counters_;
  std::atomic<CameraState> state_{CameraState::Closed};
  std::atomic<Code> code_{Code::SensorNotConnected};
  mutable std::mutex problem_mutex_;
  std::string problem_;
};

/// From the [camera] table. Throws InputError.
[[nodiscard]] std::unique_ptr<Camera> make_replay_camera(const ConfigTable& camera,
                                                         const Clock& clock);

}  // namespace grapnel
