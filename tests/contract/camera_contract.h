#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/clock.h"
#include "hal/camera.h"

namespace grapnel::test {

/// A driver, prepared for the contract suite. It must deliver frames without end, at 20 Hz or more.
class CameraUnderTest {
 public:
  virtual ~CameraUnderTest() = default;
  [[nodiscard]] virtual std::unique_ptr<Camera> make(const Clock& clock) = 0;
  /// What open() must say; `model` is not compared.
  [[nodiscard]] virtual CameraInfo declared() const = 0;

  /// For drivers of CameraLossContract: takes the device away and gives it back.
  virtual void lose_device(Camera&) {}
  virtual void return_device(Camera&) {}
};

/// One line of the list of drivers: a name of letters and digits, and how to prepare it.
struct CameraCase {
  const char* name;
  std::unique_ptr<CameraUnderTest> (*prepare)();
};

/// A capture thread's life as its hooks tell it; counts its heap calls.
class CaptureWatch {
 public:
  [[nodiscard]] CaptureHooks hooks() noexcept;
  [[nodiscard]] int threads_started() const noexcept { return started_.load(); }
  [[nodiscard]] std::uint64_t progress_calls() const noexcept { return progress_.load(); }
  /// Longest time between two calls of progress, microseconds.
  [[nodiscard]] std::int64_t longest_gap_us() const noexcept { return longest_gap_us_.load(); }
  /// Up to the last call of progress.
  [[nodiscard]] std::uint64_t heap_calls() const noexcept { return heap_calls_.load(); }

 private:
  void on_started() noexcept;
  void on_progress() noexcept;

  MonotonicClock clock_;
  std::atomic<int> started_{0};
  std::atomic<std::uint64_t> progress_{0};
  std::atomic<std::int64_t> last_us_{0};
  std::atomic<std::int64_t> longest_gap_us_{0};
  std::atomic<std::uint64_t> heap_calls_{0};
};

/// The suite. A test program instantiates it with its drivers and compiles camera_contract.cpp.
class CameraContract : public testing::TestWithParam<CameraCase> {
 protected:
  void SetUp() override;

  /// A pool as large as the driver's images. It lives as long as the fixture, so that a camera
  /// which a test leaves running never loses it.
  [[nodiscard]] FramePool* make_pool(std::size_t slots);
  /// Waits until `done()`, looking again at every publication. False after 10 s.
  [[nodiscard]] static bool wait_for(FramePool& pool, const std::function<bool()>& done);
  [[nodiscard]] static bool wait_for_frames(FramePool& pool, std::uint64_t more);

  MonotonicClock clock_;
  std::unique_ptr<CameraUnderTest> driver_;
  std::vector<std::unique_ptr<FramePool>> pools_;
  std::unique_ptr<Camera> camera_;
};

/// The part of the suite that a driver is held to whose device can go away: name it in both lists.
class CameraLossContract : public CameraContract {};

}  // namespace grapnel::test
