#include "base/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "base/input_error.h"

namespace grapnel {
namespace {

/// Closes a file descriptor at the end of the scope.
class Descriptor {
 public:
  explicit Descriptor(int fd) noexcept : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int get() const noexcept { return fd_; }

 private:
  int fd_;
};

InputError problem(const std::filesystem::path& file, const char* what, int error) {
  return InputError(file.string() + ": " + what + ": " + std::generic_category().message(error));
}

void write_all(const std::filesystem::path& file, int fd, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      throw problem(file, "can't be written", errno);
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

void sync_folder(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  const Descriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd.get() < 0 || ::fsync(fd.get()) != 0) throw problem(folder, "can't be synced", errno);
}

}  // namespace

std::vector<std::byte> read_file(const std::filesystem::path& file, std::uintmax_t max_bytes) {
  // Without O_NONBLOCK opening a pipe would wait for its writer.
  const Descriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (fd.get() < 0) throw problem(file, "can't be opened", errno);
  struct stat info {};
  if (::fstat(fd.get(), &info) != 0) throw problem(file, "can't be read", errno);
  if (!S_ISREG(info.st_mode)) throw InputError(file.string() + ": is not a regular file");
  const auto size = static_cast<std::uintmax_t>(info.st_size);
  if (size > max_bytes) {
    throw InputError(file.string() + ": " + std::to_string(size) + " bytes; at most " +
                     std::to_string(max_bytes) + " are allowed");
  }
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  std::size_t at = 0;
  while (at < bytes.size()) {
    const ssize_t got = ::read(fd.get(), bytes.data() + at, bytes.size() - at);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw problem(file, "can't be read", errno);
    if (got == 0) break;
    at += static_cast<std::size_t>(got);
  }
  bytes.resize(at);
  return bytes;
}

void write_file(const std::filesystem::path& file, std::span<const std::byte> bytes,
                WriteSync sync) {
  std::filesystem::path temporary = file;
  temporary += ".part";
  try {
    const Descriptor fd(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    if (fd.get() < 0) throw problem(file, "can't be written", errno);
    write_all(file, fd.get(), bytes);
    if (sync == WriteSync::Durable && ::fsync(fd.get()) != 0) {
      throw problem(file, "can't be synced", errno);
    }
    if (::rename(temporary.c_str(), file.c_str()) != 0) {
      throw problem(file, "can't be written", errno);
    }
  } catch (const InputError&) {
    ::unlink(temporary.c_str());
    throw;
  }
  if (sync == WriteSync::Durable) sync_folder(file);
}

void write_file(const std::filesystem::path& file, std::string_view text, WriteSync sync) {
  write_file(file, std::as_bytes(std::span(text.data(), text.size())), sync);
}

}  // namespace grapnel
