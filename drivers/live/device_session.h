#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "base/signal.h"
#include "drivers/live/sensor_device.h"

namespace grapnel {

/// One opening of a device, carried out on a thread that may hang in the capture library. The
/// keeper watches it from outside; when a call overruns its time the keeper lets go, and the
/// session, should it ever return, ends and frees itself.
class DeviceSession {
 public:
  enum class Phase : std::uint8_t { Opening, Open, Streaming, Ended };
  /// Arranges for run() to be called once on a thread that can be spared. False: it can't.
  using Launch = bool (*)(DeviceSession* session);

  /// What a session does next, and where its frames go. Held by the camera and by each session
  /// that has not ended, hung ones included; the last to leave frees it.
  struct Orders {
    Orders() = default;
    Orders(const Orders&) = delete;
    Orders& operator=(const Orders&) = delete;
    virtual ~Orders() = default;
    void leave() noexcept {
      if (holders.fetch_sub(1) == 1) delete this;
    }
    std::atomic<bool> stream{false};
    std::atomic<bool> ended{false};  ///< a recording has been played to its end
    std::atomic<FrameExchange*> exchange{nullptr};
    std::atomic<int> holders{1};
    Signal changed;  ///< at every change of a session's phase
  };

  /// Owned by its two parties, the keeper and the device's thread: each calls leave() once.
  DeviceSession(std::unique_ptr<SensorDevice> device, std::string serial, std::uint64_t generation,
                Orders& orders, bool sense);
  DeviceSession(const DeviceSession&) = delete;
  DeviceSession& operator=(const DeviceSession&) = delete;

  /// On the device's thread, once; leaves by itself.
  void run() noexcept;
  void leave() noexcept;

  // The keeper's side.
  void end() noexcept { end_.store(true); }
  [[nodiscard]] Phase phase() const noexcept { return phase_.load(); }
  [[nodiscard]] std::uint64_t generation() const noexcept { return generation_; }
  /// A library call has taken longer than it may.
  [[nodiscard]] bool overdue(std::int64_t now_us) const noexcept;
  /// The call under way is one to the tilt sensor.
  [[nodiscard]] bool sensing() const noexcept { return sensing_.load(); }
  /// Streaming since this time; 0: not.
  [[nodiscard]] std::int64_t streaming_since_us() const noexcept { return streaming_since_us_; }
  /// Valid from phase Open on.
  [[nodiscard]] const CameraInfo& info() const noexcept { return info_; }
  /// Why it ended.
  [[nodiscard]] Code code() const noexcept { return code_.load(); }
  [[nodiscard]] std::string problem() const;
  /// False when unknown.
  bool gravity(std::array<float, 3>& gravity) const noexcept;

 private:
  ~DeviceSession() = default;
  class Call;

  [[nodiscard]] bool open();
  /// False: the device is lost.
  [[nodiscard]] bool turn();
  void sense();
  void fail(const Error& error);
  void set_phase(Phase phase) noexcept;

  std::unique_ptr<SensorDevice> device_;
  const std::string serial_;
  const std::uint64_t generation_;
  Orders& orders_;
  bool sense_;
  bool streaming_ = false;
  std::int64_t sensed_us_ = 0;
  CameraInfo info_;
  std::atomic<int> parties_{2};
  std::atomic<Phase> phase_{Phase::Opening};
  std::atomic<bool> end_{false};
  std::atomic<bool> sensing_{false};
  std::atomic<std::int64_t> call_ends_us_{0};
  std::atomic<std::int64_t> streaming_since_us_{0};
  std::atomic<Code> code_{Code::SensorHealthy};
  std::array<std::atomic<float>, 3> gravity_{};
  std::atomic<bool> has_gravity_{false};
  mutable std::mutex problem_mutex_;
  std::string problem_;
};

}  // namespace grapnel
