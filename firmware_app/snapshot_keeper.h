#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "firmware_app/job_evidence.h"
#include "firmware_app/realtime.h"
#include "firmware_app/snapshot.h"

namespace grapnel {

/// Saves the evidence that arrives in a slot as one file each, on a thread of its own, and keeps
/// the newest N: a slow or full disk costs snapshots, never a job.
class SnapshotKeeper {
 public:
  static constexpr std::size_t kLogLines = 64;

  struct Parts {
    EvidenceSlot* slot = nullptr;
    /// The preset with this number of ActivePreset::origin; nothing when it is forgotten.
    std::function<std::optional<PresetOrigin>(std::uint32_t)> origin;
    std::function<void(const std::string&)> complain;  ///< one line for the log
  };
  struct Facts {
    std::filesystem::path folder;
    int keep = 0;  ///< 0: nothing is saved
    std::string build;
    std::string simd;
  };

  SnapshotKeeper(Parts parts, Facts facts);
  SnapshotKeeper(const SnapshotKeeper&) = delete;
  SnapshotKeeper& operator=(const SnapshotKeeper&) = delete;
  ~SnapshotKeeper() { stop(); }

  [[nodiscard]] bool start();
  /// Saves what has arrived and joins the thread.
  void stop() noexcept;
  /// Any thread: a line for the log tail of the snapshots to come.
  void note(const std::string& line);
  /// Saves what has arrived, once: what start()'s thread repeats. False when there was nothing.
  bool save_next();

 private:
  void run();
  void save(const JobEvidence& evidence);
  void drop_oldest() const;
  [[nodiscard]] std::string log_tail();

  Parts parts_;
  Facts facts_;
  Thread thread_;
  std::atomic<bool> stop_{false};
  std::uint64_t next_number_ = 1;
  std::uint32_t last_job_ = 0;       // the last one saved,
  std::filesystem::path last_file_;  // and where
  std::mutex mutex_;
  std::deque<std::string> lines_;
};

}  // namespace grapnel
