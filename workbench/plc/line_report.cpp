#include "workbench/plc/line_report.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "base/code.h"
#include "base/math.h"
#include "drivers/modbus/pose_format.h"
#include "workbench/evaluate/pose_error.h"

namespace grapnel {
namespace {

constexpr double kDegrees = 180.0 / math::kPi;

template <class... Values>
std::string print(const char* format, Values... values) {
  std::array<char, 512> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

/// X Y Z in mm and the three angles of a rotation about Z, Y', X'' in degrees.
std::string pose_text(const Pose& pose) {
  const PoseRegisters raw = encode_pose(pose, PoseFormat::IntrinsicZyx);
  return print("%7.1f %7.1f %7.1f  %6.1f %6.1f %6.1f", raw[0] * 1e-3, raw[1] * 1e-3, raw[2] * 1e-3,
               raw[3] * 1e-3, raw[4] * 1e-3, raw[5] * 1e-3);
}

/// Every reason of the first object, or the job's own code.
std::string codes_text(const PlcResult& result) {
  if (result.objects.empty() || result.objects[0].accepted) {
    return print("%d %s", static_cast<int>(result.code), describe(result.code).text.data());
  }
  std::string text;
  for (int bit = 0; bit < 32; ++bit) {
    if ((result.objects[0].reasons >> bit & 1U) == 0) continue;
    const auto code = static_cast<Code>(1000 + bit);
    if (!text.empty()) text += ", ";
    text += std::to_string(1000 + bit) + " " + std::string(describe(code).text);
  }
  return text.empty()
             ? print("%d %s", static_cast<int>(result.code), describe(result.code).text.data())
             : text;
}

std::vector<Vec3f> points_of(const Model& model) {
  std::vector<Vec3f> points;
  for (std::size_t i = 0; i < model.size(); ++i) {
    points.emplace_back(model.x[i], model.y[i], model.z[i]);
  }
  return points;
}

}  // namespace

std::string line_table_head() {
  return print("%-4s %-14s %-8s %-43s  %-43s %6s %6s %7s %6s  %s", "part", "what", "decision",
               "pose  X Y Z (mm)  A B C (deg)", "truth", "mm", "deg", "fitness", "ms", "code");
}

LineOutcome judge_line_answer(const LineEvent& event, const LinePart& part, const PlcAnswer& answer,
                              const Pose& frame_from_camera) {
  LineOutcome outcome;
  const PlcResult& result = answer.reading.result;
  outcome.latency_ms = static_cast<double>(answer.latency_us) * 1e-3;
  outcome.accepted = !result.objects.empty() && result.objects[0].accepted;
  switch (event.expected) {
    case Expectation::Empty:
      outcome.as_expected = result.code == Code::RoiEmpty;
      break;
    case Expectation::Wrong:
      outcome.as_expected = !outcome.accepted && result.code != Code::RoiEmpty;
      break;
    case Expectation::Accept:
      if (!outcome.accepted) break;
      const Pose camera_from_model = frame_from_camera.inverse() *
                                     result.objects[0].frame_from_grasp *
                                     part.model_from_pick.inverse();
      const PoseError error = pose_error(camera_from_model, event.camera_from_model,
                                         part.model.symmetry, points_of(part.model));
      outcome.error_m = error.mean_displacement_m;
      outcome.error_rad = error.rotation_rad;
      outcome.as_expected =
          outcome.error_m <= kLineToleranceM && outcome.error_rad <= kLineToleranceRad;
      break;
  }
  return outcome;
}

std::string line_table_row(const LineEvent& event, const LinePart& part, const PlcAnswer& answer,
                           const Pose& frame_from_camera, const LineOutcome& outcome) {
  const PlcResult& result = answer.reading.result;
  const bool seen = !result.objects.empty();
  std::string pose = "-";
  std::string truth = "-";
  std::string error = "     -      -";
  if (outcome.accepted) pose = pose_text(result.objects[0].frame_from_grasp);
  if (event.expected == Expectation::Accept) {
    Pose camera_from_model = event.camera_from_model;
    if (outcome.accepted) {
      const Pose found = frame_from_camera.inverse() * result.objects[0].frame_from_grasp *
                         part.model_from_pick.inverse();
      camera_from_model = nearest_equivalent(camera_from_model, found, part.model.symmetry);
      error = print("%6.2f %6.2f", outcome.error_m * 1e3, outcome.error_rad * kDegrees);
    }
    truth = pose_text(frame_from_camera * camera_from_model * part.model_from_pick);
  }
  const std::string fitness = seen ? print("%7.3f", result.objects[0].fitness) : "      -";
  return print("%-4u %-14s %-8s %-43s  %-43s %s %s %6.1f  ", event.id, event.kind.c_str(),
               outcome.accepted ? "accept" : "reject", pose.c_str(), truth.c_str(), error.c_str(),
               fitness.c_str(), outcome.latency_ms) +
         codes_text(result) + (outcome.as_expected ? "" : "   <-- not as expected");
}

std::string line_summary(const std::vector<LineOutcome>& outcomes) {
  std::size_t accepted = 0;
  std::size_t expected = 0;
  double worst_m = 0.0;
  double worst_rad = 0.0;
  std::vector<double> latencies_ms;
  for (const LineOutcome& outcome : outcomes) {
    if (outcome.accepted) ++accepted;
    if (outcome.as_expected) ++expected;
    worst_m = std::max(worst_m, outcome.error_m);
    worst_rad = std::max(worst_rad, outcome.error_rad);
    latencies_ms.push_back(outcome.latency_ms);
  }
  std::sort(latencies_ms.begin(), latencies_ms.end());
  const double median_ms = latencies_ms.empty() ? 0.0 : latencies_ms[latencies_ms.size() / 2];
  const double longest_ms = latencies_ms.empty() ? 0.0 : latencies_ms.back();
  return print(
      "%zu parts, %zu as expected: %zu accepted, worst error %.2f mm and %.2f deg; trigger to "
      "result median %.0f ms, longest %.0f ms",
      outcomes.size(), expected, accepted, worst_m * 1e3, worst_rad * kDegrees, median_ms,
      longest_ms);
}

}  // namespace grapnel
