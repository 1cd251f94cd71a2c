#pragma once

#include <atomic>

#include "base/signal.h"
#include "firmware_app/job_runner.h"

namespace grapnel {

/// Hands a new preset to the registration thread, which takes it over between two jobs. The config
/// thread keeps the old one alive until then.
class PresetSwitch {
 public:
  /// Config thread. The last offer must have been taken over. `wake` wakes the registration thread.
  void offer(ActivePreset* preset, Signal& wake) noexcept {
    offered_.store(preset, std::memory_order_release);
    wake.notify();
  }
  /// Config thread: true once the registration thread works with `preset`.
  [[nodiscard]] bool in_use(const ActivePreset* preset) const noexcept {
    return in_use_.load(std::memory_order_acquire) == preset;
  }

  /// Registration thread, between jobs: the newest offer, nullptr when there is no new one.
  [[nodiscard]] ActivePreset* take() noexcept {
    ActivePreset* preset = offered_.exchange(nullptr, std::memory_order_acq_rel);
    return preset;
  }
  /// Registration thread: what was taken is in use and the old one is not touched any more.
  void confirm(ActivePreset* preset) noexcept { in_use_.store(preset, std::memory_order_release); }

 private:
  std::atomic<ActivePreset*> offered_{nullptr};
  std::atomic<ActivePreset*> in_use_{nullptr};
};

}  // namespace grapnel
