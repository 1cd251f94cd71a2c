#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "pipeline/report.h"

namespace grapnel {

/// What one registration answered, ready to be shown: the best object and what belongs to the job.
struct Answer {
  enum class Status : std::uint8_t { Accepted, Rejected, Error };

  Status status = Status::Error;
  Code code = Code::InternalFault;
  std::vector<std::string> reasons;         ///< a sentence each, empty when accepted
  RegistrationReport report;                ///< defaults on error
  std::vector<RegistrationReport> objects;  ///< all reported ones, best first; empty for pairs
  std::uint32_t found = 0;                  ///< objects seen, whatever became of them
  std::string model;                        ///< name of the accepted or best model; "" for pairs
  std::uint32_t seed = 0;
  StageTimes stage_us{};
  double total_ms = 0.0;  ///< decoded inputs in memory → verdict
  std::size_t peak_bytes = 0;
};

/// "accepted", "rejected" or "error".
[[nodiscard]] const char* status_name(Answer::Status status) noexcept;

/// The answer to a job that ended without a report. Codes that say what is wrong with what
/// lies there, or that nothing does, count as rejected; all others are errors.
[[nodiscard]] Answer answer_from_error(const Error& error);

/// The answer to a job, with its best object: the first accepted one, else the first.
[[nodiscard]] Answer answer_from_reports(const RegistrationReports& reports);

/// An answer that is an error before the job began, with the sentence that explains it.
[[nodiscard]] Answer failed_answer(Code code, const std::string& why);

/// Every field of the contract; numbers that are not finite become null.
[[nodiscard]] nlohmann::ordered_json to_json(const Answer& answer);

/// Rows of four numbers.
[[nodiscard]] nlohmann::ordered_json pose_json(const Pose& pose);

/// One sentence for a person: the verdict and why.
[[nodiscard]] std::string verdict_text(const Answer& answer);

}  // namespace grapnel
