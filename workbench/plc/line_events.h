#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/geometry.h"

namespace grapnel {

/// What a station of a simulated line holds, as `grapnel simulate` writes it beside the recording.
enum class Expectation : std::uint8_t { Accept, Empty, Wrong };

/// One trigger of the line.
struct LineEvent {
  std::uint32_t id = 0;  ///< part number, from 1
  std::string kind;      ///< for people
  std::string model;     ///< the model the line asks for; its preset has the same name
  Expectation expected = Expectation::Accept;
  std::int64_t first_frame = 0;  ///< the station rests from here …
  std::int64_t last_frame = 0;   ///< … to here
  std::int64_t trigger_frame = 0;
  Pose camera_from_model = Pose::Identity();  ///< the truth while it rests; Accept only
};

/// The line's triggers and the length of the recording in frames.
struct LineScript {
  std::vector<LineEvent> events;
  std::int64_t frames = 0;
};

/// Reads events.jsonl and, for the length, objects.jsonl beside it. Throws InputError.
[[nodiscard]] LineScript load_line_script(const std::filesystem::path& events_file);

}  // namespace grapnel
