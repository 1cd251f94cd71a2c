#include "drivers/oni/oni_child.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <string>
#include <utility>

#include "base/clock.h"

extern char** environ;

namespace grapnel {
namespace {

constexpr std::int32_t kMaxSide = 8192;
constexpr std::uint32_t kMaxText = 1024;

std::int64_t now_us() noexcept { return MonotonicClock().now_us(); }

/// Everything a child takes from its parent that it should not: a blocked signal, the parent's
/// standard input and messages.
class SpawnTerms {
 public:
  explicit SpawnTerms(int output) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions_, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions_, output, STDOUT_FILENO);
    posix_spawnattr_init(&attributes_);
    sigset_t none;
    sigemptyset(&none);
    posix_spawnattr_setsigmask(&attributes_, &none);
    sigset_t pipe;
    sigemptyset(&pipe);
    sigaddset(&pipe, SIGPIPE);
    posix_spawnattr_setsigdefault(&attributes_, &pipe);
    posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  SpawnTerms(const SpawnTerms&) = delete;
  SpawnTerms& operator=(const SpawnTerms&) = delete;
  ~SpawnTerms() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }
  [[nodiscard]] int spawn(pid_t& pid, std::string program, std::string file) const {
    std::string parent = std::to_string(::getpid());
    std::array<char*, 4> arguments = {program.data(), file.data(), parent.data(), nullptr};
    return posix_spawn(&pid, program.c_str(), &actions_, &attributes_, arguments.data(), environ);
  }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

}  // namespace

OniChild::OniChild(const std::filesystem::path& player, const std::filesystem::path& file,
                   std::int64_t limit_us)
    : file_(file) {
  const std::filesystem::path whole = std::filesystem::absolute(file);
  if (!std::filesystem::is_regular_file(whole)) throw InputError(file.string() + ": is not there");
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw InputError("no pipe is left");
  pipe_ = ends[0];
  ::fcntl(pipe_, F_SETFL, O_NONBLOCK);
  const int failed = SpawnTerms(ends[1]).spawn(pid_, player.string(), whole.string());
  ::close(ends[1]);
  if (failed != 0) {
    pid_ = -1;
    end();
    throw InputError(player.string() + ": can't be started: " + std::strerror(failed));
  }
  try {
    const std::int64_t until_us = now_us() + limit_us;
    std::vector<std::byte> bytes;
    if (!fill(bytes, sizeof head_, until_us)) lost("does not answer");
    std::memcpy(&head_, bytes.data(), sizeof head_);
    const bool sized = head_.width >= 8 && head_.width <= kMaxSide && head_.height >= 8 &&
                       head_.height <= kMaxSide;
    if (head_.version != kOniWireVersion) lost("is of another build");
    if (head_.width != 0 && !sized) lost("says nonsense");
    // A file that can't be played: its head is empty, and a line of text follows.
    if (head_.width == 0) {
      while (!next(std::max<std::int64_t>(until_us - now_us(), 0), bytes)) {
        if (now_us() >= until_us) lost("does not answer");
      }
      lost("says nonsense");
    }
  } catch (...) {
    end();
    throw;
  }
}

OniChild::~OniChild() { end(); }

void OniChild::end() noexcept {
  if (pipe_ >= 0) ::close(pipe_);
  pipe_ = -1;
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  pid_ = -1;
}

void OniChild::lost(const char* how) const {
  throw OniPlayerLost(file_.string() + ": the player " + how);
}

bool OniChild::fill(std::vector<std::byte>& into, std::size_t want, std::int64_t until_us) {
  while (into.size() < want) {
    const std::size_t have = into.size();
    into.resize(want);
    const ssize_t got = ::read(pipe_, into.data() + have, want - have);
    into.resize(have + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    if (got > 0) continue;
    if (got == 0) lost("has ended before the recording's end");
    if (errno == EINTR) continue;
    if (errno != EAGAIN) lost("can't be read");
    const std::int64_t left_us = until_us - now_us();
    if (left_us <= 0) return false;
    pollfd wait{pipe_, POLLIN, 0};
    ::poll(&wait, 1, static_cast<int>(left_us / 1000 + 1));
  }
  return true;
}

void OniChild::check(const OniRecord& record) const {
  const auto pixels =
      static_cast<std::uint32_t>(head_.width) * static_cast<std::uint32_t>(head_.height);
  const bool right = (record.kind == OniKind::Depth && record.bytes == 2 * pixels) ||
                     (record.kind == OniKind::Color && record.bytes == 3 * pixels) ||
                     (record.kind == OniKind::End && record.bytes == 0) ||
                     (record.kind == OniKind::Problem && record.bytes <= kMaxText);
  if (!right) lost("says nonsense");
}

std::optional<OniRecord> OniChild::next(std::int64_t limit_us, std::vector<std::byte>& bytes) {
  const std::int64_t until_us = now_us() + limit_us;
  if (!record_) {
    OniRecord record;
    if (!fill(partial_, sizeof record, until_us)) return std::nullopt;
    std::memcpy(&record, partial_.data(), sizeof record);
    check(record);
    partial_.clear();
    record_ = record;
  }
  if (!fill(body_, record_->bytes, until_us)) return std::nullopt;
  bytes.swap(body_);
  body_.clear();
  const OniRecord done = *std::exchange(record_, std::nullopt);
  if (done.kind == OniKind::Problem) {
    throw InputError(file_.string() + ": " +
                     std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  }
  return done;
}

}  // namespace grapnel
