#include "workbench/answer.h"

#include <array>
#include <cmath>

#include "base/code.h"

namespace grapnel {
namespace {

std::string reason_sentence(const Reason& reason) {
  std::array<char, 256> text{};
  reason_text(reason, text.data(), text.size());
  return text.data();
}

std::vector<std::string> sentences(const RegistrationReport& report) {
  std::vector<std::string> texts;
  for (const Reason& reason : report.reasons.span()) texts.push_back(reason_sentence(reason));
  return texts;
}

bool found_nothing(Code code) {
  return (code >= Code::NoObjectAccepted && code <= Code::ContourDisagrees) ||
         code == Code::PartsTouch || code == Code::NoSurfaceGrasp;
}

nlohmann::ordered_json counts_json(const StageCounts& counts) {
  return {{"source_points", counts.source_points},
          {"target_points", counts.target_points},
          {"source_keypoints", counts.source_keypoints},
          {"target_keypoints", counts.target_keypoints},
          {"correspondences", counts.correspondences},
          {"after_rejection", counts.after_rejection},
          {"hypotheses", counts.hypotheses}};
}

nlohmann::ordered_json size_json(const SizeEstimate& size) {
  return {{"shape", shape_name(size.shape)},
          {"size_m", {size.size_m.x(), size.size_m.y(), size.size_m.z()}},
          {"sigma_m", size.sigma_m}};
}

nlohmann::ordered_json object_json(const RegistrationReport& object) {
  nlohmann::ordered_json json;
  json["status"] = object.accepted ? "accepted" : "rejected";
  json["code"] = static_cast<unsigned>(object.code);
  json["reasons"] = sentences(object);
  if (object.has_pose) json["transform"] = pose_json(object.target_from_source);
  if (object.has_rival) json["rival"] = pose_json(object.target_from_rival);
  if (object.surface_grasp) json["surface_grasp"] = pose_json(object.target_from_grasp);
  json["fitness"] = object.fitness;
  json["margin"] = object.margin;
  json["quality"] = object.quality;
  if (object.size.shape != SizeEstimate::Shape::None) json["size"] = size_json(object.size);
  return json;
}

nlohmann::ordered_json stage_json(const StageTimes& stage_us) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (auto i = static_cast<std::size_t>(Stage::Organize);
       i <= static_cast<std::size_t>(Stage::Judge); ++i) {
    json[stage_name(static_cast<Stage>(i))] = static_cast<double>(stage_us[i]) / 1000.0;
  }
  return json;
}

nlohmann::ordered_json checks_json(const Measured& measured) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < measured.value.size(); ++i) {
    const auto check = static_cast<Check>(i);
    if (!std::isnan(measured[check])) json[name_of(check)] = measured[check];
  }
  return json;
}

}  // namespace

const char* status_name(Answer::Status status) noexcept {
  switch (status) {
    case Answer::Status::Accepted:
      return "accepted";
    case Answer::Status::Rejected:
      return "rejected";
    case Answer::Status::Error:
      return "error";
  }
  return "error";
}

Answer answer_from_error(const Error& error) {
  const std::string stage = stage_name(error.stage);
  Answer answer = failed_answer(error.code, std::string(describe(error.code).text) +
                                                (stage.empty() ? "" : " (" + stage + ")"));
  if (found_nothing(error.code)) answer.status = Answer::Status::Rejected;
  return answer;
}

Answer answer_from_reports(const RegistrationReports& reports) {
  Answer answer;
  answer.seed = reports.seed;
  answer.stage_us = reports.stage_us;
  answer.found = reports.found;
  if (reports.objects.empty()) {
    Answer none = answer_from_error({reports.code, Stage::None, 0});
    none.seed = reports.seed;
    none.found = reports.found;
    none.stage_us = reports.stage_us;
    none.report.counts = reports.counts;
    return none;
  }
  const RegistrationReport* best = &reports.objects[0];
  for (const RegistrationReport& object : reports.objects.span()) {
    if (object.accepted) {
      best = &object;
      break;
    }
  }
  answer.report = *best;
  answer.objects.assign(reports.objects.begin(), reports.objects.end());
  answer.status = best->accepted ? Answer::Status::Accepted : Answer::Status::Rejected;
  answer.code = best->code;
  answer.reasons = sentences(*best);
  if (!best->accepted && answer.reasons.empty()) {
    answer.reasons.emplace_back(describe(best->code).text);
  }
  return answer;
}

Answer failed_answer(Code code, const std::string& why) {
  Answer answer;
  answer.code = code;
  answer.report.code = code;
  answer.reasons.push_back(why);
  return answer;
}

nlohmann::ordered_json pose_json(const Pose& pose) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (int row = 0; row < 4; ++row) {
    const Eigen::Vector4d r = pose.matrix().row(row).transpose();
    rows.push_back({r[0], r[1], r[2], r[3]});
  }
  return rows;
}

nlohmann::ordered_json to_json(const Answer& answer) {
  const RegistrationReport& report = answer.report;
  nlohmann::ordered_json json;
  json["status"] = status_name(answer.status);
  json["code"] = static_cast<unsigned>(answer.code);
  json["reasons"] = answer.reasons;
  if (answer.status != Answer::Status::Error && report.has_pose) {
    json["transform"] = pose_json(report.target_from_source);
    if (report.has_rival) json["rival"] = pose_json(report.target_from_rival);
  }
  if (!answer.objects.empty()) {
    json["found"] = answer.found;
    json["reported"] = answer.objects.size();
    for (const RegistrationReport& object : answer.objects) {
      json["objects"].push_back(object_json(object));
    }
  }
  json["fitness"] = report.fitness;
  json["rmse_m"] = report.rmse_m;
  json["coverage"] = report.coverage;
  json["free_space_violation"] = report.free_space_violation;
  json["margin"] = report.margin;
  json["sigma_m"] = report.sigma_m;
  json["sigma_rad"] = report.sigma_rad;
  json["checks"] = checks_json(report.measured);
  if (report.size.shape != SizeEstimate::Shape::None) json["size"] = size_json(report.size);
  json["seed"] = answer.seed;
  json["counts"] = counts_json(report.counts);
  json["stage_ms"] = stage_json(answer.stage_us);
  json["total_ms"] = answer.total_ms;
  json["peak_bytes"] = answer.peak_bytes;
  return json;
}

std::string verdict_text(const Answer& answer) {
  if (answer.status == Answer::Status::Accepted) return "Accepted.";
  std::string text = answer.status == Answer::Status::Error ? "Error " : "Rejected ";
  text += std::to_string(static_cast<unsigned>(answer.code)) + " (" +
          std::string(describe(answer.code).text) + ")";
  for (std::size_t i = 0; i < answer.reasons.size(); ++i) {
    if (answer.reasons[i] == describe(answer.code).text) continue;
    text += (i == 0 ? ": " : "; ") + answer.reasons[i];
  }
  return text + ".";
}

}  // namespace grapnel
