#include "drivers/replay/recording_store.h"

#include <fcntl.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "base/file.h"
#include "base/input_error.h"

namespace grapnel {
namespace {

InputError problem(const std::filesystem::path& file, const char* what, int error) {
  return InputError(file.string() + ": " + what + ": " + std::generic_category().message(error));
}

}  // namespace

FolderStore::FolderStore(std::filesystem::path folder) : folder_(std::move(folder)) {
  for (const char* name : {"depth.txt", "camera.toml"}) {
    if (std::filesystem::exists(folder_ / name)) {
      throw InputError(folder_.string() + ": holds a recording already (" + name + ")");
    }
  }
  make_folder("");
  folder_fd_ = ::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder_fd_ < 0) throw problem(folder_, "can't be opened", errno);
}

FolderStore::~FolderStore() {
  for (const auto& [name, fd] : appended_) ::close(fd);
  ::close(folder_fd_);
}

void FolderStore::make_folder(const std::string& name) {
  std::error_code code;
  std::filesystem::create_directories(folder_ / name, code);
  if (code) throw InputError((folder_ / name).string() + ": can't be made: " + code.message());
}

void FolderStore::write(const std::string& name, std::span<const std::byte> bytes) {
  write_file(folder_ / name, bytes);
}

int FolderStore::open_for_append(const std::string& name) {
  const auto known = appended_.find(name);
  if (known != appended_.end()) return known->second;
  constexpr int kFlags = O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC;
  const int fd = ::open((folder_ / name).c_str(), kFlags, 0644);
  if (fd < 0) throw problem(folder_ / name, "can't be written", errno);
  appended_.emplace(name, fd);
  return fd;
}

void FolderStore::append(const std::string& name, std::string_view text) {
  const int fd = open_for_append(name);
  const off_t end = ::lseek(fd, 0, SEEK_END);
  while (!text.empty()) {
    const ssize_t written = ::write(fd, text.data(), text.size());
    if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
    if (written > 0 || (written < 0 && errno == EINTR)) continue;
    const int error = written < 0 ? errno : ENOSPC;
    const bool undone = end >= 0 && ::ftruncate(fd, end) == 0;
    throw problem(folder_ / name, undone ? "can't be written" : "holds a part of a line", error);
  }
}

void FolderStore::sync() {
  if (::syncfs(folder_fd_) != 0) throw problem(folder_, "can't be synced", errno);
}

std::uint64_t FolderStore::free_bytes() const noexcept {
  struct statvfs space {};
  if (::fstatvfs(folder_fd_, &space) != 0) return 0;
  return static_cast<std::uint64_t>(space.f_bavail) * space.f_frsize;
}

}  // namespace grapnel
