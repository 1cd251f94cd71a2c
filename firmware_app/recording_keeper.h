#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "base/clock.h"
#include "base/log.h"
#include "drivers/replay/frame_recorder.h"
#include "drivers/replay/recording_store.h"
#include "firmware_app/job.h"
#include "firmware_app/realtime.h"
#include "firmware_app/settings.h"

namespace grapnel {

/// Records what the camera publishes while the PLC wants it (commands 53 and 54), each recording
/// into a folder of its own. All on normal threads: a slow or full disk costs frames, which are
/// counted, and never holds up capture, a job or the field bus.
class RecordingKeeper {
 public:
  struct Parts {
    RecordExchange* exchange = nullptr;
    FramePool* pool = nullptr;
    const Clock* clock = nullptr;
    std::function<std::string()> serial;  ///< of the camera
    std::function<void(LogLevel, const std::string&)> say;
  };

  /// `folder` holds the recordings.
  RecordingKeeper(Parts parts, const RecordingSettings& settings, std::filesystem::path folder);
  RecordingKeeper(const RecordingKeeper&) = delete;
  RecordingKeeper& operator=(const RecordingKeeper&) = delete;
  ~RecordingKeeper() { stop(); }

  [[nodiscard]] bool start();
  /// Ends the recording under way, writes what waits and joins the thread.
  void stop() noexcept;
  /// Works off a wish, watches the recording and tells how it stands: what start()'s thread
  /// repeats.
  void step();

 private:
  struct Running {
    Running(std::filesystem::path where, const RecordingKeeper& keeper);
    std::filesystem::path folder;
    FolderStore store;
    FrameRecorder recorder;
    std::int64_t began_us;
  };

  void run();
  void answer(const RecordRequest& request);
  [[nodiscard]] Code begin(std::uint32_t part_tag);
  void end();
  void take_counters();
  [[nodiscard]] std::filesystem::path next_folder(std::uint32_t part_tag) const;
  [[nodiscard]] RecorderOptions options() const;

  Parts parts_;
  RecordingSettings settings_;
  std::filesystem::path folder_;
  std::optional<Running> running_;
  RecordState state_;
  std::string told_;  // last problem said, so that it is said once
  Thread thread_;
  std::atomic<bool> stop_{false};
};

}  // namespace grapnel
