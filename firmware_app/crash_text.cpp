#include <cstring>

#include "firmware_app/crash_record.h"
#include "firmware_app/journal.h"

namespace grapnel {

namespace {

Stage stage_of(std::uint32_t number) {
  return number < static_cast<std::uint32_t>(Stage::kCount) ? static_cast<Stage>(number)
                                                            : Stage::None;
}

}  // namespace

std::string crash_text(const CrashRecord& record) {
  std::string text = "the last run ended by ";
  switch (record.kind) {
    case CrashKind::Assertion:
      text += "a failed assertion: " + std::string(record.what.data());
      break;
    case CrashKind::Watchdog:
      text += "the watchdog";
      break;
    default: {
      const char* name = sigdescr_np(record.signal);
      text += "signal " + std::to_string(record.signal);
      if (name != nullptr) text += std::string(" (") + name + ")";
    }
  }
  text += ", thread " + std::string(record.thread.data()) + ", ";
  const Stage at = stage_of(record.job_stage);
  text += at == Stage::None ? "no job running" : std::string("job at stage ") + stage_name(at);
  text += ", command token " + std::to_string(record.command_token) + ", build " +
          std::to_string(record.build_id);
  for (std::uint32_t i = 0; i < record.events; ++i) {
    const CrashRecord::Event& row = record.list[i];
    LogEvent event;
    event.text = row.text.data();
    event.numbers = row.numbers;
    event.code = static_cast<Code>(row.code);
    event.stage = stage_of(row.stage);
    text += "\n  " + std::to_string((row.time_us - record.time_us) / 1000) +
            " ms: " + event_text(event);
  }
  return text;
}

}  // namespace grapnel
