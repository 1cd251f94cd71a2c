#include "firmware_app/snapshot_keeper.h"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <system_error>
#include <utility>
#include <vector>

namespace grapnel {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kIdleUs = 200'000;
constexpr const char* kEnding = ".snapshot";

/// The folder's snapshots; names begin with their number, so that they sort by age.
std::vector<fs::path> snapshots_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code none;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
    if (entry.path().extension() == kEnding) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string name_of_file(std::uint64_t number, const JobEvidence& evidence) {
  char name[80] = {};
  std::snprintf(name, sizeof name, "%08llu-code%04u-tag%08x%s",
                static_cast<unsigned long long>(number),
                static_cast<unsigned>(evidence.result.code),
                static_cast<unsigned>(evidence.command.part_tag), kEnding);
  return name;
}

}  // namespace

SnapshotKeeper::SnapshotKeeper(Parts parts, Facts facts)
    : parts_(std::move(parts)), facts_(std::move(facts)) {
  const std::vector<fs::path> there = snapshots_in(facts_.folder);
  if (there.empty()) return;
  next_number_ = std::strtoull(there.back().filename().c_str(), nullptr, 10) + 1;
}

bool SnapshotKeeper::start() {
  return thread_.start([](void* self) { static_cast<SnapshotKeeper*>(self)->run(); }, this);
}

void SnapshotKeeper::stop() noexcept {
  stop_.store(true, std::memory_order_release);
  parts_.slot->arrived().notify();
  thread_.join();
}

void SnapshotKeeper::run() {
  name_this_thread("snapshots");
  for (;;) {
    const std::uint32_t seen = parts_.slot->arrived().version();
    const bool last = stop_.load(std::memory_order_acquire);
    if (save_next()) continue;
    if (last) return;
    parts_.slot->arrived().wait(seen, kIdleUs);
  }
}

void SnapshotKeeper::note(const std::string& line) {
  const std::lock_guard lock(mutex_);
  lines_.push_back(line);
  if (lines_.size() > kLogLines) lines_.pop_front();
}

std::string SnapshotKeeper::log_tail() {
  const std::lock_guard lock(mutex_);
  std::string text;
  for (const std::string& line : lines_) text += line + "\n";
  return text;
}

bool SnapshotKeeper::save_next() {
  const JobEvidence* evidence = parts_.slot->peek();
  if (evidence == nullptr) return false;
  try {
    if (facts_.keep > 0) save(*evidence);
  } catch (const std::exception& problem) {
    parts_.complain(std::string("no snapshot: ") + problem.what());
  }
  parts_.slot->release();
  return true;
}

void SnapshotKeeper::save(const JobEvidence& evidence) {
  Snapshot snapshot;
  snapshot.evidence = evidence;
  snapshot.preset = parts_.origin(evidence.origin).value_or(PresetOrigin{});
  snapshot.build = facts_.build;
  snapshot.simd = facts_.simd;
  snapshot.log = log_tail();
  snapshot.report = evidence.reported ? report_text(evidence.reports)
                                      : report_text(evidence.code, evidence.stage);
  std::error_code none;
  fs::create_directories(facts_.folder, none);
  // A job saved again was labelled meanwhile: the new file takes the old one's place.
  const bool again = evidence.job == last_job_ && fs::exists(last_file_);
  const fs::path file = again ? last_file_ : facts_.folder / name_of_file(next_number_, evidence);
  write_snapshot(file, snapshot);
  if (!again) ++next_number_;
  last_job_ = evidence.job;
  last_file_ = file;
  drop_oldest();
}

void SnapshotKeeper::drop_oldest() const {
  const std::vector<fs::path> files = snapshots_in(facts_.folder);
  const auto keep = static_cast<std::size_t>(facts_.keep);
  std::error_code none;
  for (std::size_t i = 0; i + keep < files.size(); ++i) fs::remove(files[i], none);
}

}  // namespace grapnel
