#include "firmware_app/durable_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>

#include "base/hash.h"
#include "base/input_error.h"

namespace grapnel {
namespace {

constexpr std::array<char, 8> kMagic = {'G', 'R', 'P', 'N', 'L', 'F', '0', '1'};

struct Header {
  std::array<char, 8> magic = kMagic;
  std::uint64_t bytes = 0;
  std::uint64_t hash = 0;
};

[[noreturn]] void fail(const std::filesystem::path& file, const char* what) {
  throw InputError(file.string() + ": " + what + ": " + std::strerror(errno));
}

/// Closes on every way out.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

void write_all(int fd, std::span<const std::byte> bytes, const std::filesystem::path& file) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      fail(file, "can't be written");
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

}  // namespace

void write_durable(const std::filesystem::path& file, std::span<const std::byte> content) {
  const std::filesystem::path temporary = file.string() + ".new";
  Header header;
  header.bytes = content.size();
  header.hash = hash_bytes(content);
  {
    const Descriptor out(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC,
                                S_IRUSR | S_IWUSR | S_IRGRP));
    if (out.get() < 0) fail(temporary, "can't be created");
    write_all(out.get(), std::as_bytes(std::span(&header, 1)), temporary);
    write_all(out.get(), content, temporary);
    if (::fsync(out.get()) != 0) fail(temporary, "can't be synced");
  }
  if (::rename(temporary.c_str(), file.c_str()) != 0) fail(file, "can't be replaced");
  const std::filesystem::path parent = file.has_parent_path() ? file.parent_path() : ".";
  const Descriptor folder(::open(parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.get() < 0 || ::fsync(folder.get()) != 0) fail(parent, "can't be synced");
}

std::optional<std::vector<std::byte>> read_durable(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    if (!std::filesystem::exists(file)) return std::nullopt;
    fail(file, "can't be opened");
  }
  const std::vector<char> raw((std::istreambuf_iterator<char>(stream)),
                              std::istreambuf_iterator<char>());
  Header header;
  if (raw.size() < sizeof header) throw InputError(file.string() + ": cut short");
  std::memcpy(&header, raw.data(), sizeof header);
  if (header.magic != kMagic) throw InputError(file.string() + ": not a state file");
  std::vector<std::byte> content(raw.size() - sizeof header);
  std::transform(raw.begin() + sizeof header, raw.end(), content.begin(),
                 [](char byte) { return static_cast<std::byte>(byte); });
  if (header.bytes != content.size() || header.hash != hash_bytes(content)) {
    throw InputError(file.string() + ": damaged: length or hash differ");
  }
  return content;
}

}  // namespace grapnel
