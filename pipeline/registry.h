#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/config.h"
#include "base/field.h"
#include "base/input_error.h"
#include "pipeline/stage.h"

namespace grapnel {

/// One method a stage can be done by: its name in a preset, its parameters, and how it is made.
template <class StageKind>
struct Method {
  std::string_view name;
  FieldTable (*fields)() noexcept = nullptr;
  /// Takes the method's parameters out of the table. Throws InputError.
  std::unique_ptr<StageKind> (*make)(ConfigReader& reader) = nullptr;
  /// A default value in TOML syntax, by its place among the fields; `over`: keys that a step of the
  /// pipeline asks for instead of the method's own.
  std::string (*default_text)(std::size_t field, const ConfigTable& over) = nullptr;
};

[[nodiscard]] std::span<const Method<CloudFilter>> cloud_filters() noexcept;
[[nodiscard]] std::span<const Method<NormalEstimator>> normal_estimators() noexcept;
[[nodiscard]] std::span<const Method<KeypointDetector>> keypoint_detectors() noexcept;
[[nodiscard]] std::span<const Method<DescriptorEstimator>> descriptor_estimators() noexcept;
[[nodiscard]] std::span<const Method<FeatureMatcher>> feature_matchers() noexcept;
[[nodiscard]] std::span<const Method<CorrespondenceRejector>> correspondence_rejectors() noexcept;
[[nodiscard]] std::span<const Method<HypothesisGenerator>> hypothesis_generators() noexcept;
[[nodiscard]] std::span<const Method<PoseRefiner>> pose_refiners() noexcept;

/// The method with this name. Throws InputError that lists the names there are, and the nearest.
template <class StageKind>
[[nodiscard]] const Method<StageKind>& find_method(std::span<const Method<StageKind>> methods,
                                                   std::string_view name) {
  std::string allowed;
  std::vector<std::string> names;
  for (const Method<StageKind>& method : methods) {
    if (method.name == name) return method;
    names.emplace_back(method.name);
    allowed += (allowed.empty() ? "" : ", ") + names.back();
  }
  const std::string nearest = nearest_name(name, names);
  throw InputError("method \"" + std::string(name) + "\" is unknown; allowed: " + allowed +
                   (nearest.empty() ? "" : "; did you mean \"" + nearest + "\"?"));
}

/// Makes the method that the table's key "method" names, else `fallback`.
template <class StageKind>
[[nodiscard]] std::unique_ptr<StageKind> make_method(std::span<const Method<StageKind>> methods,
                                                     ConfigReader& reader,
                                                     std::string_view fallback) {
  const std::string name = reader.take_text("method", fallback);
  try {
    return find_method(methods, name).make(reader);
  } catch (const InputError& error) {
    const std::string text = error.what();
    if (text.starts_with("method \"")) throw reader.problem("method", text);
    throw;
  }
}

}  // namespace grapnel
