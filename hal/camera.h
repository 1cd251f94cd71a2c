#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "base/error.h"
#include "base/geometry.h"
#include "hal/frame_pool.h"

namespace grapnel {

/// What a camera says of itself once it is open.
struct CameraInfo {
  std::string driver;  ///< "replay", "freenect", …
  std::string model;
  std::string serial;
  Intrinsics intrinsics;  ///< of the depth image
  double metres_per_unit = 0.001;
  double baseline_m = 0.075;
  double nominal_rate_hz = 30.0;
  bool has_color = false;
  bool live = true;        ///< false: recorded or simulated data; the PLC sees REPLAY
  bool corrected = false;  ///< its frames are: DepthFrame::corrected
};

enum class CameraState : std::uint8_t {
  Closed,
  Opened,     ///< open, not streaming
  Streaming,  ///< frames are expected
  Lost,       ///< went away; the driver tries to get it back by itself
  Ended,      ///< a recording without loop has been played to its end
};

/// A driver's own counters, since it was made.
struct CameraCounters {
  std::uint64_t frames = 0;        ///< published
  std::uint64_t dropped = 0;       ///< of the sensor's frames, never published
  std::uint64_t lost_packets = 0;  ///< in published frames
  std::uint64_t reconnects = 0;
  std::uint64_t bad_frames =
      0;  ///< unreadable, torn or all-invalid frames that were dropped (also in `dropped`)
};

/// State at one moment. `code` is SensorHealthy while all is well, else the 20xx that says why not.
struct CameraStatus {
  CameraState state = CameraState::Closed;
  Code code = Code::SensorNotConnected;
  CameraCounters counters;
  /// Direction of the accelerometer's reading in the sensor's frame, in g; all zero: it has none.
  std::array<float, 3> gravity{};
};

/// Lets the owner prepare a driver's capture thread (scheduling class, name, accounting) and see it
/// live.
struct CaptureHooks {
  void (*thread_started)(void* context) noexcept =
      nullptr;  ///< on the capture thread, before its first frame
  void (*progress)(void* context) noexcept =
      nullptr;  ///< on the capture thread, at least every 100 ms while it lives
  void* context = nullptr;
};

/// A depth camera. One owner thread makes all calls except status(), stepped() and request_frame(),
/// which any thread may make.
/// open → start → stop → close; start and stop may repeat; a call out of order is refused or does
/// nothing, it never harms. The camera contract suite holds every driver to this.
class Camera {
 public:
  virtual ~Camera() = default;

  /// Finds the device or opens the recording. May allocate and block up to some seconds. On failure
  /// `problem()` says why in one line. Opening an open camera answers its info again.
  virtual Result<CameraInfo> open() = 0;
  /// Starts the capture thread, which fills `pool` until stop(). The pool must outlive stop(), and
  /// be as large as the intrinsics say. Refused (Busy) while streaming, (SensorNotConnected) when
  /// not open.
  virtual Status start(FramePool& pool, const CaptureHooks& hooks) = 0;
  /// After it returns nothing more is published. Does nothing when not streaming.
  virtual void stop() noexcept = 0;
  /// Stops and lets the device go.
  virtual void close() noexcept = 0;

  [[nodiscard]] virtual CameraStatus status() const noexcept = 0;
  /// True: frames come one by one, each at a request_frame(). Else the camera free-runs.
  [[nodiscard]] virtual bool stepped() const noexcept { return false; }
  /// Asks a stepped camera for its next frame and does not wait for it.
  virtual void request_frame() noexcept {}
  /// The last failure in one line for a person; "" when there was none.
  [[nodiscard]] virtual std::string problem() const = 0;
};

}  // namespace grapnel
