#pragma once

#include <atomic>

#include "firmware_app/crash_record.h"
#include "firmware_app/job_executor.h"
#include "firmware_app/preset_switch.h"
#include "firmware_app/realtime.h"
#include "firmware_app/supervisor.h"
#include "firmware_app/thread_account.h"

namespace grapnel {

/// The registration thread: takes presets over between jobs, carries jobs out, shows that it lives.
class RegistrationLoop {
 public:
  struct Parts {
    JobExecutor* executor = nullptr;
    JobExchange* exchange = nullptr;
    PresetSwitch* presets = nullptr;
    Supervisor* supervisor = nullptr;
    ThreadAccount* account = nullptr;
    CrashReporter* crash = nullptr;
  };

  RegistrationLoop(Parts parts, const Scheduling& scheduling)
      : parts_(parts), scheduling_(scheduling) {}
  RegistrationLoop(const RegistrationLoop&) = delete;
  RegistrationLoop& operator=(const RegistrationLoop&) = delete;
  ~RegistrationLoop() { stop(); }

  [[nodiscard]] bool start();
  /// Ends a running job at its next stage boundary and joins the thread.
  void stop() noexcept;
  [[nodiscard]] bool scheduling_refused() const noexcept {
    return scheduling_refused_.load(std::memory_order_relaxed);
  }

  /// One round: what start()'s thread repeats. True when a job was carried out.
  bool round() noexcept;

 private:
  void run();

  Parts parts_;
  Scheduling scheduling_;
  Thread thread_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> scheduling_refused_{false};
};

}  // namespace grapnel
