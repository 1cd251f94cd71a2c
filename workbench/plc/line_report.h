#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/modbus/plc_client.h"
#include "pipeline/model.h"
#include "workbench/plc/line_events.h"

namespace grapnel {

/// What the emulator knows of a part it asks for.
struct LinePart {
  std::uint16_t preset = 0;
  Model model;
  Pose model_from_pick = Pose::Identity();  ///< what the device reports the pose of
};

/// How one trigger went.
struct LineOutcome {
  bool as_expected = false;
  bool accepted = false;
  double error_m = 0.0;  ///< mean displacement of the model's points; accepted and true pose known
  double error_rad = 0.0;
  double latency_ms = 0.0;  ///< trigger written → result read
};

/// A right pose is within these.
inline constexpr double kLineToleranceM = 0.005;
inline constexpr double kLineToleranceRad = 0.0524;

/// The table's head and one line of it.
[[nodiscard]] std::string line_table_head();
[[nodiscard]] std::string line_table_row(const LineEvent& event, const LinePart& part,
                                         const PlcAnswer& answer, const Pose& frame_from_camera,
                                         const LineOutcome& outcome);

/// Compares an answer with the truth. `frame_from_camera` is the frame the poses are reported in.
[[nodiscard]] LineOutcome judge_line_answer(const LineEvent& event, const LinePart& part,
                                            const PlcAnswer& answer, const Pose& frame_from_camera);

/// One line about all of them.
[[nodiscard]] std::string line_summary(const std::vector<LineOutcome>& outcomes);

}  // namespace grapnel
