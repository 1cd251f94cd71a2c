#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "base/log.h"

namespace grapnel {

/// Why a run ended.
enum class CrashKind : std::uint32_t { None, Assertion, Signal, Watchdog };

/// What a dying process leaves behind, as it lies in the reserved file.
struct CrashRecord {
  static constexpr std::size_t kEvents = 64;
  static constexpr std::uint64_t kMagic = 0x32305243'4c504e47ULL;  // "GNPLCR02"

  struct Event {
    std::int64_t time_us = 0;
    std::array<std::int64_t, 3> numbers{};
    std::uint16_t code = 0;
    std::uint16_t stage = 0;
    std::uint16_t level = 0;
    std::array<char, 74> text{};
  };

  std::uint64_t magic = 0;  ///< kMagic when the record is filled
  CrashKind kind = CrashKind::None;
  std::int32_t signal = 0;
  std::uint32_t build_id = 0;
  std::uint32_t command_token = 0;
  std::uint32_t job_stage = 0;  ///< Stage that the registration thread was at; None: no job ran
  std::int64_t time_us = 0;
  std::array<char, 16> thread{};
  std::array<char, 160> what{};  ///< failed expression, file and line
  std::uint32_t events = 0;      ///< how many of the list are filled, oldest first
  std::array<Event, kEvents> list{};
};

/// The last events of the run, as plain memory that a signal handler may read.
class EventHistory {
 public:
  void add(const LogEvent& event) noexcept;
  /// Copies the events, oldest first. Async-signal-safe.
  std::uint32_t copy_to(std::array<CrashRecord::Event, CrashRecord::kEvents>& out) const noexcept;

 private:
  std::array<CrashRecord::Event, CrashRecord::kEvents> ring_{};
  std::atomic<std::uint64_t> count_{0};
};

/// The reserved file, mapped at start: writing it at the end takes no system call but one.
class CrashReporter {
 public:
  CrashReporter() = default;
  CrashReporter(const CrashReporter&) = delete;
  CrashReporter& operator=(const CrashReporter&) = delete;
  ~CrashReporter();

  /// Reserves `file`. What the last run left there is given back once, then cleared. Throws
  /// InputError.
  [[nodiscard]] std::optional<CrashRecord> open(const std::filesystem::path& file,
                                                std::uint32_t build_id);
  /// Installs handlers of fatal signals and of failed assertions for the whole process.
  void install();
  [[nodiscard]] EventHistory& history() noexcept { return history_; }
  /// The command being worked off, for the record.
  void set_command_token(std::uint32_t token) noexcept {
    token_.store(token, std::memory_order_relaxed);
  }
  /// Where the registration thread notes the stage it is at.
  [[nodiscard]] std::atomic<Stage>& job_stage() noexcept { return job_stage_; }
  /// Housekeeping found a thread silent: a SIGABRT that comes now is the watchdog's.
  void set_stalled(bool stalled) noexcept { stalled_.store(stalled, std::memory_order_relaxed); }

  /// Fills the record. Async-signal-safe.
  void write(CrashKind kind, int signal, const char* what) noexcept;

 private:
  CrashRecord* record_ = nullptr;
  std::uint32_t build_id_ = 0;
  std::atomic<std::uint32_t> token_{0};
  std::atomic<Stage> job_stage_{Stage::None};
  std::atomic<bool> stalled_{false};
  EventHistory history_;
};

/// A record in some lines for the journal.
[[nodiscard]] std::string crash_text(const CrashRecord& record);

}  // namespace grapnel
