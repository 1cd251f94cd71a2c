#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/registrar.h"
#include "workbench/answer.h"
#include "workbench/input.h"
#include "workbench/registrar_store.h"

namespace grapnel {

/// Whether SOURCE is a model that is looked for in TARGET, or a view of the same things.
enum class RegistrationKind : std::uint8_t { Object, Pair };

/// What a registration needs beside its preset.
struct JobInputs {
  RegistrationKind kind = RegistrationKind::Pair;
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
  /// Takes its registrar from `store`, which it is added to, or makes one of its own (nullptr). A
  /// job on a store ends with the next job on it. Throws InputError.
  Job(const JobInputs& inputs, const std::string& preset, const std::vector<std::string>& overrides,
      RegistrarStore* store = nullptr);
  ~Job();
  Job(const Job&) = delete;
  Job& operator=(const Job&) = delete;

  [[nodiscard]] Answer run();

  /// The source's points with a reading, metres.
  [[nodiscard]] std::vector<Vec3f> source_points() const;
  [[nodiscard]] Symmetry symmetry() const noexcept { return symmetry_; }
  /// What is looked for, nullptr for pairs.
  [[nodiscard]] const Model* model() const noexcept {
    return prepared_->model ? &*prepared_->model : nullptr;
  }
  [[nodiscard]] const Input& target() const noexcept { return target_; }
  /// The view that is moved, nullptr for objects.
  [[nodiscard]] const Input* source() const noexcept { return source_ ? &*source_ : nullptr; }
  [[nodiscard]] CloudData source_cloud() const;
  [[nodiscard]] CloudData target_cloud() const;

 private:
  RegistrationKind kind_;
  JobContext context_;
  MonotonicClock clock_;
  Symmetry symmetry_ = Symmetry::None;
  std::optional<Input> source_;  // Pair
  Input target_;
  RegistrarStore own_{1};
  PreparedRegistrar* prepared_ = nullptr;
};

/// True when NAME.toml lies beside a model NAME.ply or NAME.pcd.
[[nodiscard]] bool has_model_file(const std::string& source);

}  // namespace grapnel
