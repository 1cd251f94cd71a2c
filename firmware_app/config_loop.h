#pragma once

#include <atomic>
#include <filesystem>

#include "base/clock.h"
#include "firmware_app/config_keeper.h"
#include "firmware_app/journal.h"
#include "firmware_app/realtime.h"
#include "firmware_app/wakeup.h"

namespace grapnel {

/// The config thread: lets the keeper work off the PLC's wishes, and changed files as they change.
class ConfigLoop {
 public:
  struct Parts {
    ConfigKeeper* keeper = nullptr;
    Wakeup* wake = nullptr;
    const Clock* clock = nullptr;
    Journal* journal = nullptr;
  };

  /// `config`: the configuration file, watched together with the folder of presets it names.
  ConfigLoop(Parts parts, std::filesystem::path config)
      : parts_(parts), config_(std::move(config)) {}
  ConfigLoop(const ConfigLoop&) = delete;
  ConfigLoop& operator=(const ConfigLoop&) = delete;
  ~ConfigLoop() { stop(); }

  [[nodiscard]] bool start();
  void stop() noexcept;
  /// Any thread: the file is read again though it may not have changed.
  void ask_reload() noexcept;

 private:
  void run();

  Parts parts_;
  std::filesystem::path config_;
  Thread thread_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> reload_{false};
};

}  // namespace grapnel
