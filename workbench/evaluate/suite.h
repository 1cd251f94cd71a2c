#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/geometry.h"
#include "pipeline/model.h"

namespace grapnel {

enum class CaseKind : std::uint8_t { Scene, Pair, Many };
enum class Expect : std::uint8_t { Accept, Reject, Either };

/// One view of a case of many.
struct SuiteView {
  std::string source;
  std::string camera;  ///< of a bare PNG; "" = the case's
  std::string color;
  std::string mask;           ///< black = leave out; "" = none
  std::optional<Pose> truth;  ///< into a frame that all views of the case share
};

/// One case of a suite. Paths are as the inputs take them, relative ones already made absolute.
struct SuiteCase {
  std::string id;
  CaseKind kind = CaseKind::Pair;
  std::string source;
  std::string target;
  std::string camera;        ///< camera.toml of bare PNGs; "" = none
  std::string color;         ///< colour of a bare PNG target; "" = none
  std::string source_color;  ///< the same of the source
  std::optional<Pose> truth;
  std::optional<Pose> initial;
  std::optional<Symmetry> symmetry;  ///< overrides the model's
  std::vector<SuiteView> views;      ///< of kind many; all have a truth or none has
  Expect expect = Expect::Reject;
  std::string group;  ///< "" = independent of every other case
};

/// What `evaluate` runs on.
struct Suite {
  std::string name;
  double tolerance_m = 0.005;
  double tolerance_rad = 0.0524;
  std::vector<SuiteCase> cases;
};

/// Reads a suite. Throws InputError with file, line, key, value and what is allowed.
[[nodiscard]] Suite load_suite(const std::filesystem::path& file);

/// "scene", "accept", … as in the file.
[[nodiscard]] const char* kind_name(CaseKind kind) noexcept;
[[nodiscard]] const char* expect_name(Expect expect) noexcept;

}  // namespace grapnel
