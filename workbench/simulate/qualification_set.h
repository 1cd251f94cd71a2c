#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>

#include "workbench/simulate/part_instance.h"

namespace grapnel {

/// Limits are found on the first, looked at on the second, and shown once on the third: no instance
/// of one is in another.
enum class Split : std::uint8_t { Tune, Validate, Lockbox };
inline constexpr std::string_view kSplitNames[] = {"tune", "validate", "lockbox"};

struct QualificationParams {
  PartClass part = PartClass::Carton;
  Split split = Split::Tune;
  std::uint64_t seed = 1;
  int instances = 5;
  int positives = 50;  ///< the part alone or among clutter: right is accepted
  int either = 10;     ///< half hidden or touched: a right pose may be accepted
  int negatives = 50;  ///< not there: right is rejected
};

/// Writes a simulated set: FOLDER/models (a model an instance), FOLDER/recording (a frame a case,
/// depth only) and FOLDER/suite.toml. The same parameters give the same bytes. `progress` is called
/// once a case. Throws InputError when the folder can't be written or holds a recording.
void write_qualification_set(const QualificationParams& params, const std::filesystem::path& folder,
                             const std::function<void()>& progress);

}  // namespace grapnel
