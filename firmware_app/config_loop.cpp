#include "firmware_app/config_loop.h"

#include <poll.h>

#include "firmware_app/config_watch.h"

namespace grapnel {
namespace {

constexpr int kSwitchingMs = 2;
constexpr int kIdleMs = 100;

}  // namespace

bool ConfigLoop::start() {
  return thread_.start([](void* self) { static_cast<ConfigLoop*>(self)->run(); }, this);
}

void ConfigLoop::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  parts_.wake->notify();
  thread_.join();
}

void ConfigLoop::ask_reload() noexcept {
  reload_.store(true);
  parts_.wake->notify();
}

void ConfigLoop::run() {
  name_this_thread("config");
  ConfigWatch watch;
  std::filesystem::path presets = parts_.keeper->settings().presets_folder();
  const bool watched = watch.watch_file(config_) && watch.watch_folder(presets);
  if (!watched) {
    parts_.journal->write(LogLevel::Warning,
                          "configuration files can't be watched; command 42 reloads them");
  }
  while (!stop_.load(std::memory_order_acquire)) {
    pollfd waits[2] = {{watch.descriptor(), POLLIN, 0}, {parts_.wake->descriptor(), POLLIN, 0}};
    ::poll(waits, 2, parts_.keeper->switching() ? kSwitchingMs : kIdleMs);
    parts_.wake->clear();
    const bool asked = reload_.exchange(false);
    parts_.keeper->step(watch.changed(parts_.clock->now_us()) || asked);
    if (parts_.keeper->settings().presets_folder() != presets) {
      presets = parts_.keeper->settings().presets_folder();
      watch.watch_folder(presets);
    }
  }
}

}  // namespace grapnel
