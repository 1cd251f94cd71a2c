#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/config.h"

namespace grapnel {

/// A key of a preset and the values it is tried with, in TOML syntax.
struct SpaceKey {
  std::string key;  ///< with dots, as --set takes it
  std::vector<std::string> values;
  int line = 0;
};

/// Which presets `tune` tries: one value of every key over the base.
struct Space {
  std::string file;
  std::string base;        ///< a preset; "" = the general one
  std::size_t draws = 32;  ///< combinations tried; all where there are no more
  std::uint64_t seed = 1;  ///< of the combinations drawn and of the order of cases
  std::vector<SpaceKey> keys;
};

/// Reads SPACE.toml: base, draws, seed and the table [keys]. Throws InputError with file, line,
/// key, value and what is allowed.
[[nodiscard]] Space load_space(const std::filesystem::path& file);

/// "key=value" of the keys; methods come first, as another method drops the keys of the one before.
using Combination = std::vector<std::string>;

/// Different combinations of values for the base. One that it does not allow with the others, as a
/// key of a method that was not chosen, is left out of that combination. Throws InputError where a
/// value is allowed in none.
[[nodiscard]] std::vector<Combination> combinations(const Space& space,
                                                    const std::filesystem::path& base);

}  // namespace grapnel
