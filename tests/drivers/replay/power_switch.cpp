#include "tests/drivers/replay/power_switch.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <system_error>

namespace grapnel::test {
namespace {

namespace fs = std::filesystem;

PowerSwitch* g_switch = nullptr;

std::string path_of(int fd) {
  std::array<char, 512> path{};
  const std::string link = "/proc/self/fd/" + std::to_string(fd);
  const ssize_t length = ::readlink(link.c_str(), path.data(), path.size());
  return length > 0 ? std::string(path.data(), static_cast<std::size_t>(length)) : std::string();
}

int power_is_off() {
  errno = EIO;
  return -1;
}

}  // namespace

PowerSwitch::PowerSwitch(fs::path folder, int calls)
    : folder_(fs::weakly_canonical(folder).string()), left_(calls) {
  g_switch = this;
}

PowerSwitch::~PowerSwitch() { g_switch = nullptr; }

bool PowerSwitch::watches(const std::string& path) const { return path.starts_with(folder_); }

void PowerSwitch::end(const char* call) {
  last_call_ = call;
  cut_ = --left_ <= 0;
}

void PowerSwitch::wrote(const std::string& path, std::uintmax_t before) {
  unsynced_.try_emplace(path, before);
  end("write");
}

void PowerSwitch::renamed(const std::string& from, const std::string& to) {
  if (const auto found = unsynced_.find(from); found != unsynced_.end()) {
    unsynced_[to] = found->second;
    unsynced_.erase(from);
  }
  names_.emplace_back(from, to);
  end("rename");
}

void PowerSwitch::synced(const std::string& path) {
  unsynced_.erase(path);
  end("fsync");
}

void PowerSwitch::synced_all() {
  unsynced_.clear();
  names_.clear();
  end("syncfs");
}

void PowerSwitch::lose(Loss loss) {
  g_switch = nullptr;
  if (loss == Loss::Nothing) return;
  for (const auto& [path, safe] : unsynced_) {
    std::error_code none;
    const std::uintmax_t size = fs::file_size(path, none);
    if (!none) fs::resize_file(path, safe + (size - safe) / 2);
  }
  if (loss == Loss::Data) return;
  for (auto name = names_.rbegin(); name != names_.rend(); ++name) {
    fs::rename(name->second, name->first);
  }
}

}  // namespace grapnel::test

using grapnel::test::g_switch;
using grapnel::test::path_of;
using grapnel::test::power_is_off;

// In the place of the C library's own.
extern "C" {

ssize_t write(int fd, const void* bytes, std::size_t count) {
  const std::string path = g_switch != nullptr ? path_of(fd) : std::string();
  if (g_switch == nullptr || !g_switch->watches(path)) return syscall(SYS_write, fd, bytes, count);
  if (g_switch->cut()) return power_is_off();
  struct stat before {};
  ::fstat(fd, &before);
  const ssize_t written = syscall(SYS_write, fd, bytes, count);
  if (written >= 0) g_switch->wrote(path, static_cast<std::uintmax_t>(before.st_size));
  return written;
}

int rename(const char* from, const char* to) noexcept {
  const bool watched = g_switch != nullptr && g_switch->watches(from);
  if (watched && g_switch->cut()) return power_is_off();
  const long done = syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0);
  if (watched && done == 0) g_switch->renamed(from, to);
  return static_cast<int>(done);
}

int fsync(int fd) {
  const std::string path = g_switch != nullptr ? path_of(fd) : std::string();
  if (g_switch == nullptr || !g_switch->watches(path)) {
    return static_cast<int>(syscall(SYS_fsync, fd));
  }
  if (g_switch->cut()) return power_is_off();
  g_switch->synced(path);
  return 0;
}

int syncfs(int fd) noexcept {
  const std::string path = g_switch != nullptr ? path_of(fd) : std::string();
  if (g_switch == nullptr || !g_switch->watches(path)) {
    return static_cast<int>(syscall(SYS_syncfs, fd));
  }
  if (g_switch->cut()) return power_is_off();
  g_switch->synced_all();
  return 0;
}

int ftruncate(int fd, off_t length) noexcept {
  const bool off = g_switch != nullptr && g_switch->cut() && g_switch->watches(path_of(fd));
  return off ? power_is_off() : static_cast<int>(syscall(SYS_ftruncate, fd, length));
}

int unlink(const char* path) noexcept {
  const bool off = g_switch != nullptr && g_switch->cut() && g_switch->watches(path);
  return off ? power_is_off() : static_cast<int>(syscall(SYS_unlinkat, AT_FDCWD, path, 0));
}
}
