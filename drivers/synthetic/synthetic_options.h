#pragma once

#include <cstdint>
#include <string>

#include "base/config.h"
#include "base/field.h"

namespace grapnel {

/// When a simulated camera hands out its frames.
enum class SyntheticPace : std::uint8_t {
  TrueTime,  ///< at the scene's rate
  Fast,      ///< as fast as they render
};

/// The keys of [camera] when driver = "synthetic".
struct SyntheticOptions {
  std::string scene;  ///< SCENE.toml; relative to the configuration's folder
  SyntheticPace mode = SyntheticPace::TrueTime;
  bool loop = true;
  std::string serial;  ///< the unit to open; "": any

  [[nodiscard]] static FieldTable fields() noexcept;
};

/// Reads the table; `driver` is skipped. Throws InputError.
[[nodiscard]] SyntheticOptions read_synthetic_options(const ConfigTable& camera);

}  // namespace grapnel
