#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/registrar.h"
#include "workbench/answer.h"
#include "workbench/input.h"

namespace grapnel {

/// Whether SOURCE is a model that is looked for in TARGET, or a view of the same things.
enum class JobKind : std::uint8_t { Object, Pair };

/// What a registration needs beside its preset.
struct JobInputs {
  JobKind kind = JobKind::Pair;
  std::string source;
  InputOptions source_options;
  std::string target;
  InputOptions target_options;
  std::optional<Symmetry> symmetry;  ///< overrides the model's
  std::optional<Pose> initial;
};

/// One registration, ready to run as often as wanted: inputs decoded, model prepared, memory taken.
/// The limits of the preset are raised to what the inputs need.
class Job {
 public:
  /// Throws InputError.
  Job(const JobInputs& inputs, const std::string& preset,
      const std::vector<std::string>& overrides);
  ~Job();
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  [[nodiscard]] Answer run();

  /// The source's points with a reading, metres.
  [[nodiscard]] std::vector<Vec3f> source_points() const;
  [[nodiscard]] Symmetry symmetry() const noexcept { return symmetry_; }
  [[nodiscard]] CloudData source_cloud() const;
  [[nodiscard]] CloudData target_cloud() const;

 private:
  JobKind kind_;
  JobContext context_;
  MonotonicClock clock_;
  Symmetry symmetry_ = Symmetry::None;
  std::optional<Model> model_;   // Object
  std::optional<Input> source_;  // Pair
  Input target_;
  std::unique_ptr<Registrar> registrar_;
};

/// True when NAME.toml lies beside a model NAME.ply or NAME.pcd.
[[nodiscard]] bool has_model_file(const std::string& source);

}  // namespace grapnel
