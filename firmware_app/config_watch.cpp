#include "firmware_app/config_watch.h"

#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

namespace grapnel {

ConfigWatch::ConfigWatch() : fd_(inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {}

ConfigWatch::~ConfigWatch() {
  if (fd_ >= 0) ::close(fd_);
}

bool ConfigWatch::watch_file(const std::filesystem::path& file) {
  const std::filesystem::path whole = std::filesystem::absolute(file);
  return add(whole.parent_path(), whole.filename().string());
}

bool ConfigWatch::watch_folder(const std::filesystem::path& folder) { return add(folder, ""); }

bool ConfigWatch::add(const std::filesystem::path& folder, const std::string& name) {
  constexpr std::uint32_t kChanges = IN_CLOSE_WRITE | IN_MOVED_TO | IN_MOVED_FROM | IN_DELETE;
  const int watch = inotify_add_watch(fd_, folder.c_str(), kChanges);
  if (watch < 0) return false;
  rows_.push_back({watch, name});
  return true;
}

bool ConfigWatch::concerns(int watch, const std::string& name) const {
  return std::any_of(rows_.begin(), rows_.end(), [&](const Row& row) {
    if (row.watch != watch) return false;
    return row.name.empty() ? name.ends_with(".toml") : row.name == name;
  });
}

bool ConfigWatch::changed(std::int64_t now_us) {
  alignas(inotify_event) char buffer[4096];
  for (;;) {
    const ssize_t bytes = ::read(fd_, buffer, sizeof buffer);
    if (bytes <= 0) break;
    for (ssize_t at = 0; at < bytes;) {
      inotify_event event;
      std::memcpy(&event, buffer + at, sizeof event);
      const char* name = buffer + at + sizeof event;
      const bool overflow = (event.mask & IN_Q_OVERFLOW) != 0;
      if (overflow || (event.len > 0 && concerns(event.wd, name))) {
        settle_until_us_ = now_us + kSettleUs;
      }
      at += static_cast<ssize_t>(sizeof event + event.len);
    }
  }
  if (settle_until_us_ < 0 || now_us < settle_until_us_) return false;
  settle_until_us_ = -1;
  return true;
}

}  // namespace grapnel
