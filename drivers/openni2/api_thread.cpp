#include "drivers/openni2/api_thread.h"

#include <OpenNI.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "base/clock.h"

namespace grapnel {
namespace {

enum class Library { Down, Up, Failed };
std::atomic<Library> library{Library::Down};

class ApiThread {
 public:
  bool post(std::function<void()> task) {
    const std::lock_guard lock(mutex_);
    if (!running_) {
      try {
        std::thread([this] { run(); }).detach();
      } catch (const std::system_error&) {
        return false;
      }
      running_ = true;
    }
    tasks_.push_back(std::move(task));
    changed_.notify_one();
    return true;
  }

 private:
  [[noreturn]] void run() {
    const bool up = openni::OpenNI::initialize() == openni::STATUS_OK;
    library.store(up ? Library::Up : Library::Failed);
    for (;;) {
      std::function<void()> task;
      {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return !tasks_.empty(); });
        task = std::move(tasks_.front());
        tasks_.pop_front();
      }
      task();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool running_ = false;
};

}  // namespace

bool post_to_openni(std::function<void()> task) {
  // Never destroyed: its thread outlives everything.
  static auto* const thread = new ApiThread;
  return thread->post(std::move(task));
}

bool bring_openni_up(std::int64_t limit_us) {
  if (!post_to_openni([] {})) return false;
  const MonotonicClock clock;
  const std::int64_t until_us = clock.now_us() + limit_us;
  while (library.load() == Library::Down && clock.now_us() < until_us) {
    clock.sleep_until_us(clock.now_us() + 1'000);
  }
  return openni_is_up();
}

bool openni_is_up() noexcept { return library.load() == Library::Up; }

}  // namespace grapnel
