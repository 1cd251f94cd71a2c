#include "firmware_app/crash_record.h"

#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>

#include "base/assert.h"
#include "base/input_error.h"

namespace grapnel {
namespace {

std::atomic<CrashReporter*> g_reporter{nullptr};

/// Copies a text as far as it fits; always terminated. Async-signal-safe.
template <std::size_t kSize>
void copy_text(std::array<char, kSize>& out, const char* text) noexcept {
  std::size_t i = 0;
  for (; i + 1 < kSize && text[i] != '\0'; ++i) out[i] = text[i];
  out[i] = '\0';
}

template <std::size_t kSize>
void append_text(std::array<char, kSize>& out, const char* text) noexcept {
  std::size_t length = 0;
  while (length + 1 < kSize && out[length] != '\0') ++length;
  std::size_t i = 0;
  for (; length + i + 1 < kSize && text[i] != '\0'; ++i) out[length + i] = text[i];
  out[length + i] = '\0';
}

void on_fatal_signal(int signal) noexcept {
  CrashReporter* reporter = g_reporter.exchange(nullptr);
  if (reporter != nullptr) reporter->write(CrashKind::Signal, signal, "");
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void on_assertion(const char* expression, const char* file, int line) noexcept {
  std::array<char, 160> what{};
  copy_text(what, expression);
  append_text(what, " at ");
  append_text(what, file);
  append_text(what, ":");
  char digits[12] = {};
  int at = 11;
  for (int rest = line; rest > 0 && at > 0; rest /= 10) {
    digits[--at] = static_cast<char>('0' + rest % 10);
  }
  append_text(what, digits + at);
  CrashReporter* reporter = g_reporter.exchange(nullptr);
  if (reporter != nullptr) reporter->write(CrashKind::Assertion, 0, what.data());
  [[maybe_unused]] const ssize_t written = ::write(2, what.data(), std::strlen(what.data()));
  std::signal(SIGABRT, SIG_DFL);
  std::raise(SIGABRT);
}

}  // namespace

void EventHistory::add(const LogEvent& event) noexcept {
  const std::uint64_t number = count_.load(std::memory_order_relaxed);
  CrashRecord::Event& row = ring_[number % ring_.size()];
  row.time_us = event.time_us;
  row.numbers = event.numbers;
  row.code = static_cast<std::uint16_t>(event.code);
  row.stage = static_cast<std::uint16_t>(event.stage);
  row.level = static_cast<std::uint16_t>(event.level);
  copy_text(row.text, event.text);
  count_.store(number + 1, std::memory_order_release);
}

std::uint32_t EventHistory::copy_to(
    std::array<CrashRecord::Event, CrashRecord::kEvents>& out) const noexcept {
  const std::uint64_t count = count_.load(std::memory_order_acquire);
  const std::uint64_t held = std::min<std::uint64_t>(count, ring_.size());
  for (std::uint64_t i = 0; i < held; ++i) out[i] = ring_[(count - held + i) % ring_.size()];
  return static_cast<std::uint32_t>(held);
}

CrashReporter::~CrashReporter() {
  CrashReporter* self = this;
  if (g_reporter.compare_exchange_strong(self, nullptr)) set_assert_handler(nullptr);
  if (record_ != nullptr) munmap(record_, sizeof(CrashRecord));
}

std::optional<CrashRecord> CrashReporter::open(const std::filesystem::path& file,
                                               std::uint32_t build_id) {
  build_id_ = build_id;
  const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, S_IRUSR | S_IWUSR | S_IRGRP);
  if (fd < 0) throw InputError(file.string() + ": can't be opened: " + std::strerror(errno));
  const bool reserved = ::ftruncate(fd, sizeof(CrashRecord)) == 0 &&
                        ::posix_fallocate(fd, 0, sizeof(CrashRecord)) == 0;
  void* mapped = reserved
                     ? mmap(nullptr, sizeof(CrashRecord), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0)
                     : MAP_FAILED;
  ::close(fd);
  if (mapped == MAP_FAILED) {
    throw InputError(file.string() + ": can't be reserved: " + std::strerror(errno));
  }
  record_ = static_cast<CrashRecord*>(mapped);
  std::optional<CrashRecord> left;
  if (record_->magic == CrashRecord::kMagic) {
    left = *record_;
    left->events = std::min<std::uint32_t>(left->events, CrashRecord::kEvents);
    left->thread.back() = '\0';
    left->what.back() = '\0';
    for (CrashRecord::Event& event : left->list) event.text.back() = '\0';
  }
  *record_ = CrashRecord{};
  return left;
}

void CrashReporter::install() {
  g_reporter.store(this);
  set_assert_handler(&on_assertion);
  struct sigaction action {};
  action.sa_handler = [](int signal) { on_fatal_signal(signal); };
  action.sa_flags = SA_RESETHAND;
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGSYS}) {
    sigaction(signal, &action, nullptr);
  }
}

void CrashReporter::write(CrashKind kind, int signal, const char* what) noexcept {
  if (record_ == nullptr) return;
  CrashRecord& record = *record_;
  const bool watchdog = signal == SIGABRT && stalled_.load(std::memory_order_relaxed);
  record.kind = watchdog ? CrashKind::Watchdog : kind;
  record.signal = signal;
  record.build_id = build_id_;
  record.command_token = token_.load(std::memory_order_relaxed);
  record.job_stage = static_cast<std::uint32_t>(job_stage_.load(std::memory_order_relaxed));
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  record.time_us = static_cast<std::int64_t>(now.tv_sec) * 1'000'000 + now.tv_nsec / 1000;
  pthread_getname_np(pthread_self(), record.thread.data(), record.thread.size());
  copy_text(record.what, what);
  record.events = history_.copy_to(record.list);
  record.magic = CrashRecord::kMagic;
  msync(record_, sizeof(CrashRecord), MS_SYNC);
}

}  // namespace grapnel
