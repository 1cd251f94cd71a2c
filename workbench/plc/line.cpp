#include "workbench/plc/line.h"

#include <algorithm>
#include <cstdint>
#include <iostream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/input_error.h"
#include "drivers/modbus/plc_client.h"
#include "firmware_app/preset_source.h"
#include "firmware_app/settings.h"
#include "pipeline/preset.h"
#include "workbench/options.h"
#include "workbench/plc/line_events.h"
#include "workbench/plc/line_report.h"

namespace grapnel {
namespace {

constexpr std::int64_t kPollUs = 10'000;
constexpr std::int64_t kReadyTimeoutUs = 30'000'000;
constexpr int kSelectTimeoutMs = 10'000;
constexpr int kAnswerTimeoutMs = 10'000;
// A station missed (a slow preset change, a busy machine) comes round again.
constexpr int kMaxLaps = 4;

class Line {
 public:
  Line(const PlcClientOptions& client, LineScript script, const Settings& settings)
      : client_(client),
        script_(std::move(script)),
        robot_from_camera_(settings.robot_from_camera()) {
    for (const LineEvent& event : script_.events) {
      if (parts_.count(event.model) != 0) continue;
      const Preset preset = load_preset(find_preset(settings.presets_folder(), event.model),
                                        settings.models_folder(), settings.roi.overrides);
      if (preset.models.empty()) throw InputError(preset.file.string() + ": no model");
      const ModelProfile profile = profile_of(preset, settings).models[0];
      parts_[event.model] = {preset.number, preset.models.front(),
                             profile.model_from_grasp * profile.grasp_from_pick};
    }
  }

  int run() {
    if (!client_.connect()) fail();
    wait_until_ready();
    std::cout << line_table_head() << std::endl;
    std::vector<bool> done(script_.events.size(), false);
    std::vector<LineOutcome> outcomes;
    const std::int64_t first = position();
    while (outcomes.size() < script_.events.size()) {
      if (position() - first > kMaxLaps * script_.frames) break;
      const std::size_t next = next_event(done);
      const std::optional<LineOutcome> outcome = serve(script_.events[next]);
      if (!outcome) continue;
      done[next] = true;
      outcomes.push_back(*outcome);
    }
    std::cout << "\n" << line_summary(outcomes) << std::endl;
    const bool all = outcomes.size() == script_.events.size() &&
                     std::all_of(outcomes.begin(), outcomes.end(),
                                 [](const LineOutcome& outcome) { return outcome.as_expected; });
    return all ? 0 : 1;
  }

 private:
  [[noreturn]] void fail() { throw InputError(client_.problem()); }

  PlcReading read() {
    PlcReading reading;
    if (!client_.read(reading)) fail();
    return reading;
  }

  /// Frames of the recording played so far, laps and dropped frames included.
  std::int64_t position() {
    constexpr std::uint16_t kDroppedFrames = 602;
    std::uint16_t words[2] = {};
    if (!client_.read_input(kDroppedFrames, 2, words)) fail();
    const std::int64_t dropped = std::int64_t{words[0]} << 16 | words[1];
    return read().status.frame_count + dropped;
  }

  void wait_until_ready() {
    const std::int64_t give_up_us = clock_.now_us() + kReadyTimeoutUs;
    for (;;) {
      const PlcStatus status = read().status;
      if ((status.flags & kFlagReady) != 0) return;
      if (status.state == PlcState::Stopped) command(PlcCommandCode::Arm, 0, false);
      if (clock_.now_us() > give_up_us) {
        throw InputError("the device does not get ready: status " +
                         std::to_string(static_cast<int>(status.status_code)));
      }
      clock_.sleep_until_us(clock_.now_us() + kPollUs);
    }
  }

  PlcAnswer command(PlcCommandCode code, std::uint16_t preset, bool wait, std::uint32_t tag = 0) {
    PlcCommand command;
    command.code = static_cast<std::uint16_t>(code);
    command.preset_id = preset;
    command.part_tag = tag;
    const int timeout_ms =
        code == PlcCommandCode::SelectPreset ? kSelectTimeoutMs : kAnswerTimeoutMs;
    const Result<PlcAnswer> answer = client_.run(command, timeout_ms, wait);
    if (!answer) fail();
    return answer.value();
  }

  /// The event not yet done that comes to rest next.
  std::size_t next_event(const std::vector<bool>& done) {
    const std::int64_t now = position() % script_.frames;
    std::size_t best = 0;
    std::int64_t best_wait = script_.frames;
    for (std::size_t i = 0; i < done.size(); ++i) {
      if (done[i]) continue;
      std::int64_t wait = script_.events[i].trigger_frame - now;
      if (wait < 0) wait += script_.frames;
      if (wait >= best_wait) continue;
      best = i;
      best_wait = wait;
    }
    return best;
  }

  void select(std::uint16_t preset) {
    if (read().status.active_preset == preset) return;
    const PlcAnswer answer = command(PlcCommandCode::SelectPreset, preset, true);
    if (read().status.active_preset == preset) return;
    throw InputError("preset " + std::to_string(preset) + " can't be selected: " +
                     std::to_string(static_cast<int>(answer.reading.result.code)));
  }

  /// Nothing when the station had gone before the frame was taken.
  std::optional<LineOutcome> serve(const LineEvent& event) {
    const LinePart& part = parts_.at(event.model);
    select(part.preset);
    const auto rests = [&](std::int64_t frame) {
      const std::int64_t in_lap = frame % script_.frames;
      return in_lap >= event.trigger_frame && in_lap <= event.last_frame;
    };
    for (;;) {
      const std::int64_t now = position();
      if (rests(now)) break;
      clock_.sleep_until_us(clock_.now_us() + kPollUs);
    }
    const PlcAnswer answer = command(PlcCommandCode::Register, 0, true, event.id);
    const PlcResult& result = answer.reading.result;
    if (result.frame_id != 0) {
      const std::int64_t in_lap = std::int64_t{result.frame_id} % script_.frames;
      if (in_lap < event.first_frame || in_lap > event.last_frame) return std::nullopt;
    }
    const bool robot = !result.objects.empty() && result.objects[0].frame == PoseFrame::RobotBase;
    const Pose frame_from_camera = robot ? robot_from_camera_ : Pose::Identity();
    const LineOutcome outcome = judge_line_answer(event, part, answer, frame_from_camera);
    std::cout << line_table_row(event, part, answer,
                                outcome.accepted ? frame_from_camera : robot_from_camera_, outcome)
              << std::endl;
    return outcome;
  }

  PlcClient client_;
  LineScript script_;
  Pose robot_from_camera_;
  std::map<std::string, LinePart> parts_;
  MonotonicClock clock_;
};

}  // namespace

int run_plc_line(std::span<const std::string> args) {
  std::string address;
  std::string events;
  std::string config;
  Options options("plc", "The PLC of a simulated line: triggers at every station.");
  options.positional("HOST:PORT", address, "the device; port 502 unless given");
  options.required("--events", events, "events.jsonl of the recording that the device plays");
  options.required("--config", config, "grapnel.toml of the device: presets and calibration");
  options.footer("Exit code 1: an answer was not as expected.");
  if (!options.parse(args)) return 0;
  PlcClientOptions client;
  const std::size_t colon = address.rfind(':');
  client.host = address.substr(0, colon);
  if (colon != std::string::npos) {
    client.port = static_cast<int>(parse_numbers(address.substr(colon + 1), 1, "the port").front());
  }
  return Line(client, load_line_script(events), load_settings(config, {})).run();
}

}  // namespace grapnel
