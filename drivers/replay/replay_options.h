#pragma once

#include <cstdint>
#include <string>

#include "base/config.h"
#include "base/field.h"

namespace grapnel {

/// When the frames of a recording are handed out.
enum class ReplayMode : std::uint8_t {
  TrueTime,  ///< by their timestamps, times `factor`
  Fast,      ///< as fast as they decode
  Stepped,   ///< one at each request: the daemon asks once a job
};

/// What happens at a frame that can't be read.
enum class OnBadFrame : std::uint8_t {
  Error,  ///< the replay ends there, with the reason
  Drop,   ///< it is left out and counted
};

/// The keys of [camera] when driver = "replay".
struct ReplayOptions {
  std::string path;  ///< the recording's folder; relative to the configuration's folder
  ReplayMode mode = ReplayMode::TrueTime;
  double factor = 1.0;
  bool loop = false;
  std::int64_t start = 0;
  std::int64_t count = 0;
  OnBadFrame on_bad_frame = OnBadFrame::Error;

  [[nodiscard]] static FieldTable fields() noexcept;
};

/// Reads the table; `driver` is skipped. Throws InputError.
[[nodiscard]] ReplayOptions read_replay_options(const ConfigTable& camera);

}  // namespace grapnel
