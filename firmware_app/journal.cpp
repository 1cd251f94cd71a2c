#include "firmware_app/journal.h"

#include <sys/stat.h>

#include <cstdlib>
#include <ctime>

namespace grapnel {
namespace {

/// syslog(3) priority.
int priority_of(LogLevel level) {
  switch (level) {
    case LogLevel::Debug:
      return 7;
    case LogLevel::Info:
      return 6;
    case LogLevel::Warning:
      return 4;
    case LogLevel::Fault:
      return 3;
  }
  return 6;
}

const char* level_name(LogLevel level) {
  switch (level) {
    case LogLevel::Debug:
      return "debug";
    case LogLevel::Info:
      return "info";
    case LogLevel::Warning:
      return "warning";
    case LogLevel::Fault:
      return "fault";
  }
  return "info";
}

bool stderr_is_journal() {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat status {};
  if (stream == nullptr || fstat(2, &status) != 0) return false;
  return std::string(stream) == std::to_string(status.st_dev) + ":" + std::to_string(status.st_ino);
}

}  // namespace

Journal::Journal() : to_journal_(stderr_is_journal()), out_(stderr) {}

bool Journal::allowed(std::int64_t second) {
  if (second != second_) {
    const int cut = cut_;
    second_ = second;
    lines_ = 0;
    cut_ = 0;
    if (cut > 0) print(LogLevel::Warning, std::to_string(cut) + " lines left out");
  }
  if (lines_ >= kMaxLinesPerSecond) {
    ++cut_;
    return false;
  }
  ++lines_;
  return true;
}

void Journal::write(LogLevel level, std::string_view text) {
  const std::lock_guard<std::mutex> lock(mutex_);
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  if (allowed(now.tv_sec)) print(level, text);
}

void Journal::print(LogLevel level, std::string_view text) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (to_journal_) {
    std::fprintf(out_, "<%d>%.*s\n", priority_of(level), static_cast<int>(text.size()),
                 text.data());
  } else {
    tm broken{};
    gmtime_r(&now.tv_sec, &broken);
    char stamp[32];
    std::strftime(stamp, sizeof stamp, "%Y-%m-%dT%H:%M:%S", &broken);
    std::fprintf(out_, "%s.%03ldZ %s: %.*s\n", stamp, now.tv_nsec / 1'000'000, level_name(level),
                 static_cast<int>(text.size()), text.data());
  }
  std::fflush(out_);
}

void Journal::write(const LogEvent& event) { write(event.level, event_text(event)); }

std::string event_text(const LogEvent& event) {
  std::string text;
  std::size_t number = 0;
  for (const char* c = event.text; *c != '\0'; ++c) {
    if (c[0] == '{' && c[1] == '}' && number < event.numbers.size()) {
      text += std::to_string(event.numbers[number++]);
      ++c;
    } else {
      text += *c;
    }
  }
  if (event.code != Code::Ok) {
    text += " (" + std::to_string(static_cast<unsigned>(event.code)) + " " +
            std::string(describe(event.code).text) + ")";
  }
  if (event.stage != Stage::None) text += std::string(" [") + stage_name(event.stage) + "]";
  return text;
}

}  // namespace grapnel
