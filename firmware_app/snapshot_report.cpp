#include <string>

#include "base/formats/text_writer.h"
#include "firmware_app/snapshot.h"

namespace grapnel {
namespace {

/// "key value…" lines.
class Lines {
 public:
  template <class... Values>
  void add(const char* key, const Values&... values) {
    text_ += key;
    (put(values), ...);
    text_ += '\n';
  }
  [[nodiscard]] std::string take() { return std::move(text_); }

 private:
  void put(double value) {
    text_ += ' ';
    append_number(text_, value);
  }
  void put(std::uint32_t value) { text_ += ' ' + std::to_string(value); }
  void put(const char* value) { text_ += std::string(" ") + value; }
  void put(bool value) { text_ += value ? " yes" : " no"; }
  void put(Code value) { text_ += ' ' + std::to_string(static_cast<unsigned>(value)); }
  template <class Derived>
  void put(const Eigen::MatrixBase<Derived>& matrix) {
    for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
      for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
        put(static_cast<double>(matrix(row, column)));
      }
    }
  }
  void put(const StageCounts& counts) {
    for (const std::uint32_t count :
         {counts.source_points, counts.target_points, counts.source_keypoints,
          counts.target_keypoints, counts.correspondences, counts.after_rejection,
          counts.hypotheses}) {
      put(count);
    }
  }

  std::string text_;
};

void add_object(Lines& lines, const RegistrationReport& object) {
  lines.add("object", object.model, object.accepted, object.code);
  for (const Reason& reason : object.reasons.span()) {
    lines.add("reason", name_of(reason.check), reason.measured, reason.limit);
  }
  if (object.has_pose) lines.add("target_from_source", object.target_from_source.matrix());
  if (object.has_rival) lines.add("target_from_rival", object.target_from_rival.matrix());
  if (object.surface_grasp) lines.add("target_from_grasp", object.target_from_grasp.matrix());
  lines.add("fit", object.fitness, object.rmse_m, object.coverage);
  lines.add("view", object.free_space_violation, object.occluded, object.unknown);
  lines.add("margin", object.margin);
  lines.add("sigma", object.sigma_m, object.sigma_rad);
  for (std::size_t i = 0; i < object.measured.value.size(); ++i) {
    lines.add(name_of(static_cast<Check>(i)), static_cast<double>(object.measured.value[i]));
  }
  lines.add("quality", object.quality, object.symmetric, object.budget_reached);
  lines.add("covariance", object.covariance);
  lines.add("iterations", object.iterations, object.converged);
  lines.add("counts", object.counts);
}

}  // namespace

std::string report_text(const RegistrationReports& reports) {
  Lines lines;
  lines.add("code", reports.code);
  lines.add("found", reports.found);
  lines.add("seed", reports.seed);
  lines.add("counts", reports.counts);
  for (const RegistrationReport& object : reports.objects.span()) add_object(lines, object);
  return lines.take();
}

std::string report_text(Code code, Stage stage) {
  Lines lines;
  lines.add("code", code);
  lines.add("stage", static_cast<std::uint32_t>(stage));
  return lines.take();
}

}  // namespace grapnel
