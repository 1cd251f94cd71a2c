#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "firmware_app/job_evidence.h"

namespace grapnel {

/// A model as a preset had it loaded.
struct SnapshotModel {
  std::string name;
  std::uint64_t hash = 0;  ///< of the file's bytes
};

/// Where a preset in use came from: enough to build it again.
struct PresetOrigin {
  std::string config;                  ///< grapnel.toml, the text in use
  std::string file;                    ///< name of the preset's file
  std::string text;                    ///< of the preset's file
  std::vector<std::string> overrides;  ///< "key=value"
  std::string models_folder;
  std::vector<SnapshotModel> models;
};

/// One job with all it depended on, in one file: frame, colour, background, context, preset,
/// configuration, result, log tail, versions.
struct Snapshot {
  JobEvidence evidence;  ///< its images view the three below, except while it is being made
  std::vector<std::uint16_t> depth;
  std::vector<Rgb8> color;
  std::vector<std::uint16_t> background;
  PresetOrigin preset;
  std::string build;
  std::string simd;
  std::string log;     ///< last lines before the job was saved
  std::string report;  ///< report_text() of the live job
};

/// The whole answer of the pipeline as text, every number so that it reads back the same; without
/// the times, which differ from run to run.
[[nodiscard]] std::string report_text(const RegistrationReports& reports);
/// The same for a job that ended without reports.
[[nodiscard]] std::string report_text(Code code, Stage stage);

/// Replaces the file durably. Throws InputError.
void write_snapshot(const std::filesystem::path& file, const Snapshot& snapshot);
/// What write_snapshot() puts into the file.
[[nodiscard]] std::vector<std::byte> encode_snapshot(const Snapshot& snapshot);
/// Throws InputError when it is no snapshot, or one whose parts contradict each other; `name` is
/// for its message.
[[nodiscard]] Snapshot parse_snapshot(std::span<const std::byte> bytes, const std::string& name);
/// Throws InputError when it is damaged.
[[nodiscard]] Snapshot read_snapshot(const std::filesystem::path& file);

/// "none", "good", "bad".
[[nodiscard]] const char* name_of(GraspLabel label) noexcept;

}  // namespace grapnel
