#pragma once

#include <array>
#include <cstdint>

namespace grapnel {

/// What grapnel-oni-player writes to its standard output: a head, then records, each followed by
/// its bytes. Both programs are of one build; the version guards against a stale one.
inline constexpr std::uint64_t kOniWireVersion = 0x31'49'4e'4f'50'52'47ULL;  // "GRPONI1"

struct OniHead {
  std::uint64_t version = kOniWireVersion;
  std::int32_t width = 0;
  std::int32_t height = 0;
  double horizontal_fov_rad = 0.0;
  double vertical_fov_rad = 0.0;
  double metres_per_unit = 0.001;
  std::int32_t rate_hz = 30;
  std::int32_t has_color = 0;
  std::int64_t depth_frames = -1;  ///< as the file says; negative: it was not closed
};

enum class OniKind : std::uint32_t {
  Depth = 1,
  Color = 2,
  End = 3,
  Problem = 4,  ///< its bytes are one line of text
};

struct OniRecord {
  OniKind kind = OniKind::End;
  std::uint32_t bytes = 0;
  std::int64_t time_us = 0;  ///< of the recording, from 0
  std::int64_t index = 0;    ///< frame number in its stream, from 1
};

}  // namespace grapnel
