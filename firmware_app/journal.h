#pragma once

#include <cstdio>
#include <mutex>
#include <string>
#include <string_view>

#include "base/log.h"

namespace grapnel {

/// Lines on stderr: under systemd's journal with its "<N>" priority, else with time and level. Any
/// thread but the real-time ones, which have the LogRing.
class Journal {
 public:
  /// Finds out from JOURNAL_STREAM whether stderr is the journal.
  Journal();
  explicit Journal(bool to_journal, std::FILE* out) : to_journal_(to_journal), out_(out) {}

  void write(LogLevel level, std::string_view text);
  /// "text with numbers (code: its short name) [stage]".
  void write(const LogEvent& event);
  /// At most this many lines a second; what is cut is counted and said.
  static constexpr int kMaxLinesPerSecond = 50;

 private:
  bool allowed(std::int64_t second);
  void print(LogLevel level, std::string_view text);

  std::mutex mutex_;
  bool to_journal_ = false;
  std::FILE* out_;
  std::int64_t second_ = -1;
  int lines_ = 0;
  int cut_ = 0;
};

/// The sentence of an event: {} replaced by its numbers, then code and stage where it has them.
[[nodiscard]] std::string event_text(const LogEvent& event);

}  // namespace grapnel
