#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/clock.h"
#include "base/input_error.h"
#include "drivers/modbus/plc_client.h"
#include "workbench/commands.h"
#include "workbench/evaluate/statistics.h"
#include "workbench/options.h"
#include "workbench/plc/line.h"
#include "workbench/plc/strict.h"

namespace grapnel {
namespace {

using nlohmann::json;

constexpr std::int64_t kBeatUs = 100'000;
constexpr int kCommandTimeoutMs = 5000;

struct PlcRun {
  PlcClientOptions client;
  PlcCommand command;
  std::int64_t count = 1;  // 0: for ever
  std::int64_t interval_ms = 1000;
  std::int64_t answer_timeout_ms = 10000;
  bool arm = true;
  bool strict = false;
  bool as_json = false;
};

std::string code_text(Code code) {
  const auto number = static_cast<int>(code);
  const CodeEntry& entry = describe(code);
  std::string text = std::to_string(number);
  if (entry.code == code) text.append(" ").append(entry.text);
  return text;
}

std::string number_text(double value, int decimals) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

bool is_job(std::uint16_t code) {
  constexpr std::array kJobs = {PlcCommandCode::Register,
                                PlcCommandCode::Capture,
                                PlcCommandCode::RegisterLastCapture,
                                PlcCommandCode::RegisterWithRetries,
                                PlcCommandCode::SaveSnapshot,
                                PlcCommandCode::GraspGood,
                                PlcCommandCode::GraspBad,
                                PlcCommandCode::RecordBegin,
                                PlcCommandCode::RecordEnd,
                                PlcCommandCode::LearnBackground,
                                PlcCommandCode::CheckRoiEmpty};
  return std::any_of(kJobs.begin(), kJobs.end(), [code](PlcCommandCode job) {
    return static_cast<std::uint16_t>(job) == code;
  });
}

json reasons_json(std::uint32_t reasons) {
  json list = json::array();
  for (int bit = 0; bit < 32; ++bit) {
    if ((reasons >> bit & 1u) != 0) list.push_back(1000 + bit);
  }
  return list;
}

const char* decision_text(const PlcObject& object) {
  if (object.accepted) return "accept";
  return object.surface_grasp ? "surface_grasp" : "reject";
}

json object_json(const PlcObject& object, const PoseRegisters& pose, std::uint16_t format) {
  json out = {{"decision", decision_text(object)},
              {"code", static_cast<int>(object.code)},
              {"reasons", reasons_json(object.reasons)},
              {"model_id", object.model_id},
              {"pick_point_id", object.pick_point_id},
              {"frame", static_cast<int>(object.frame)},
              {"fitness", object.fitness},
              {"rmse_m", object.rmse_m},
              {"coverage", object.coverage},
              {"margin", object.margin},
              {"free_space_violation", object.free_space_violation},
              {"sigma_m", object.sigma_m},
              {"sigma_rad", object.sigma_rad},
              {"quality_bits", object.quality_bits},
              {"quality_score", object.quality_score},
              {"pose", nullptr},
              {"transform", nullptr}};
  if (!object.has_pose()) return out;
  const double rotation = rotation_scale(static_cast<PoseFormat>(format));
  json numbers = json::array();
  for (std::size_t i = 0; i < pose.size(); ++i)
    numbers.push_back(pose[i] * (i < 3 ? 1e-3 : rotation));
  out["pose"] = numbers;
  json matrix = json::array();
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      matrix.push_back(object.frame_from_grasp.matrix()(row, column));
    }
  }
  out["transform"] = matrix;
  return out;
}

json answer_json(const PlcAnswer& answer, std::uint32_t part_tag) {
  const PlcResult& result = answer.reading.result;
  json out = {{"part_tag", part_tag},
              {"ack_code", static_cast<int>(answer.ack_code)},
              {"state", static_cast<int>(answer.reading.status.state)},
              {"flags", answer.reading.status.flags},
              {"status_code", static_cast<int>(answer.reading.status.status_code)},
              {"latency_ms", static_cast<double>(answer.latency_us) * 1e-3}};
  if (!answer.done) return out;
  out["result"] = {{"number", answer.reading.result_no},
                   {"cmd_seq", result.cmd_seq},
                   {"code", static_cast<int>(result.code)},
                   {"found", result.found},
                   {"pose_format", result.pose_format},
                   {"frame_id", result.frame_id},
                   {"enc_capture", result.enc_capture},
                   {"capture_delay_us", result.capture_delay_us},
                   {"age_us", result.age_us},
                   {"part_tag", result.part_tag},
                   {"retries", result.retries},
                   {"total_us", result.total_us},
                   {"preset", result.preset},
                   {"preset_rev", result.preset_rev},
                   {"seed", result.seed},
                   {"objects", json::array()}};
  for (std::size_t i = 0; i < result.objects.size(); ++i) {
    out["result"]["objects"].push_back(
        object_json(result.objects[i], answer.reading.poses[i], result.pose_format));
  }
  return out;
}

std::string pose_text(const PoseRegisters& pose, std::uint16_t format) {
  const double scale = rotation_scale(static_cast<PoseFormat>(format));
  const int decimals = scale < 1e-4 ? 6 : 3;
  std::string text;
  for (std::size_t i = 0; i < 3; ++i) {
    text.append(1, "XYZ"[i]).append(" ").append(number_text(pose[i] * 1e-3, 3)).append(" ");
  }
  text += "mm, R";
  const std::size_t parts = format == static_cast<int>(PoseFormat::Planar)       ? 1
                            : format == static_cast<int>(PoseFormat::Quaternion) ? 4
                                                                                 : 3;
  for (std::size_t i = 0; i < parts; ++i)
    text.append(" ").append(number_text(pose[3 + i] * scale, decimals));
  return text;
}

void print_answer(const PlcAnswer& answer, std::uint32_t part_tag) {
  const PlcReading& reading = answer.reading;
  std::cout << "part " << part_tag << ": ";
  if (answer.ack_code != Code::Accepted) {
    std::cout << "command refused: " << code_text(answer.ack_code) << std::endl;
    return;
  }
  if (!answer.done) {
    std::cout << "command accepted, state " << static_cast<int>(reading.status.state) << std::endl;
    return;
  }
  std::cout << code_text(reading.result.code) << ", "
            << number_text(static_cast<double>(answer.latency_us) * 1e-3, 1)
            << " ms after the trigger, frame " << reading.result.frame_id
            << ((reading.status.flags & kFlagReplay) != 0 ? " (not live)" : "") << "\n";
  for (std::size_t i = 0; i < reading.result.objects.size(); ++i) {
    const PlcObject& object = reading.result.objects[i];
    std::cout << "  object " << i + 1 << ": " << decision_text(object) << ", model "
              << object.model_id << ", "
              << (object.has_pose() ? pose_text(reading.poses[i], reading.result.pose_format)
                                    : code_text(object.code))
              << ", fitness " << number_text(object.fitness, 4) << ", rmse "
              << number_text(object.rmse_m * 1e3, 3) << " mm, margin "
              << number_text(object.margin, 4) << "\n";
  }
  std::cout.flush();
}

[[noreturn]] void give_up(const PlcClient& client) { throw InputError(client.problem()); }

void arm(PlcClient& client) {
  PlcReading reading;
  if (!client.read(reading)) give_up(client);
  if ((reading.status.flags & kFlagReady) != 0 || (reading.status.flags & kFlagBusy) != 0) return;
  PlcCommand command;
  command.code = static_cast<std::uint16_t>(PlcCommandCode::Arm);
  const Result<PlcAnswer> answer = client.run(command, kCommandTimeoutMs, false);
  if (!answer) give_up(client);
  if (answer.value().ack_code != Code::Accepted) {
    throw InputError("the device can't be armed: " + code_text(answer.value().ack_code));
  }
}

void wait_until(PlcClient& client, std::int64_t until_us) {
  const MonotonicClock clock;
  while (true) {
    if (!client.beat_if_due()) give_up(client);
    const std::int64_t now_us = clock.now_us();
    if (now_us >= until_us) return;
    clock.sleep_until_us(std::min(until_us, now_us + kBeatUs));
  }
}

void take_address(const std::string& address, PlcClientOptions& client) {
  const std::size_t colon = address.rfind(':');
  client.host = address.substr(0, colon);
  double port = client.port;
  if (colon != std::string::npos) {
    port = parse_numbers(address.substr(colon + 1), 1, "the port").front();
  }
  if (client.host.empty() || !(port >= 1 && port <= 65535)) {
    throw InputError("\"" + address + "\" is not allowed; HOST or HOST:PORT is");
  }
  client.port = static_cast<int>(port);
}

bool read_arguments(std::span<const std::string> args, PlcRun& run) {
  std::string address;
  std::string word_order = "ABCD";
  std::int64_t code = static_cast<std::int64_t>(PlcCommandCode::Register);
  std::int64_t preset = 0;
  std::int64_t model = 0;
  std::int64_t format = 0;
  std::int64_t timeout_ms = 0;
  std::int64_t tag = 1;
  std::int64_t unit_id = 1;
  std::int64_t heartbeat_ms = 0;
  bool no_arm = false;
  Options options("plc", "A PLC's side of the field bus: triggers and prints each result.");
  options.positional("HOST:PORT", address, "the device; port 502 unless given");
  options.integer("--count", run.count, 0, 1'000'000'000, "triggers; 0 goes on for ever");
  options.integer("--interval-ms", run.interval_ms, 0, 3'600'000, "from trigger to trigger");
  options.integer("--code", code, 0, 65535, "command code, 20 captures and registers");
  options.integer("--preset", preset, 0, 65535, "PRESET_ID; 0 keeps the active one");
  options.integer("--model", model, 0, 65535, "MODEL_ID; 0 is all of the preset");
  options.integer("--format", format, 0, 7, "POSE_FORMAT; 0 is the preset's");
  options.integer("--timeout-ms", timeout_ms, 0, 65535, "TIMEOUT_MS; 0 is the preset's");
  options.integer("--tag", tag, 0, 4'000'000'000, "PART_TAG of the first trigger; counts up");
  options.integer("--answer-timeout-ms", run.answer_timeout_ms, 1, 3'600'000,
                  "how long to wait for a result");
  options.integer("--heartbeat-ms", heartbeat_ms, 0, 60000, "HB_LIMIT_MS; 0 sends no heartbeat");
  options.integer("--unit", unit_id, 0, 255, "unit id");
  options.value("--word-order", word_order, "ABCD or CDAB, as the device is configured");
  options.flag("--single-writes", run.client.single_writes, "function 6 only, CMD_SEQ last");
  options.flag("--no-arm", no_arm, "send no command 10 when the device is not ready");
  options.flag("--strict", run.strict,
               "trigger by the clock even while the last job runs, and count what came of it");
  options.flag("--json", run.as_json, "one JSON object on standard output");
  options.footer(
      "With --events FILE --config grapnel.toml it triggers at every station of a simulated line\n"
      "and compares each answer with the truth.\n"
      "Exit code 1: a trigger was refused or not answered; with --strict also: answered late.");
  if (!options.parse(args)) return false;
  take_address(address, run.client);
  if (word_order != "ABCD" && word_order != "CDAB") {
    throw InputError("--word-order " + word_order + " is not allowed; ABCD or CDAB is");
  }
  run.client.word_order = word_order == "ABCD" ? WordOrder::Abcd : WordOrder::Cdab;
  run.client.heartbeat_limit_ms = static_cast<std::uint16_t>(heartbeat_ms);
  run.client.unit_id = static_cast<int>(unit_id);
  if (run.strict && run.count == 0) {
    throw InputError("--count 0 is not allowed with --strict; 1 to 1000000000 is");
  }
  run.arm = !no_arm;
  run.command.code = static_cast<std::uint16_t>(code);
  run.command.preset_id = static_cast<std::uint16_t>(preset);
  run.command.model_id = static_cast<std::uint16_t>(model);
  run.command.pose_format = static_cast<std::uint16_t>(format);
  run.command.timeout_ms = static_cast<std::uint16_t>(timeout_ms);
  run.command.part_tag = static_cast<std::uint32_t>(tag);
  return true;
}

json tally_json(const StrictTally& tally) {
  std::vector<double> ms;
  for (const std::int64_t us : tally.latencies_us) ms.push_back(static_cast<double>(us) * 1e-3);
  if (ms.empty()) ms.push_back(0.0);
  json codes = json::object();
  for (const auto& [code, times] : tally.codes) codes[std::to_string(code)] = times;
  return {{"triggers", tally.triggers},
          {"answered", tally.answered},
          {"refused_busy", tally.refused_busy},
          {"refused_other", tally.refused_other},
          {"late", tally.late},
          {"lost", tally.lost},
          {"accepted", tally.accepted},
          {"codes", codes},
          {"latency_ms",
           {{"p50", quantile(ms, 0.5)}, {"p99", quantile(ms, 0.99)}, {"max", quantile(ms, 1.0)}}}};
}

int run_strict(PlcClient& client, const PlcRun& run) {
  StrictCycle cycle;
  cycle.command = run.command;
  cycle.count = run.count;
  cycle.interval_ms = run.interval_ms;
  cycle.answer_timeout_ms = run.answer_timeout_ms;
  const std::optional<StrictTally> tally = run_strict_cycle(client, cycle);
  if (!tally) give_up(client);
  const json out = tally_json(*tally);
  if (run.as_json) {
    std::cout << out << "\n";
  } else {
    for (const auto& [name, value] : out.items()) std::cout << name << ": " << value << "\n";
  }
  return tally->answered == tally->triggers && tally->late == 0 ? 0 : 1;
}

}  // namespace

int run_plc(std::span<const std::string> args) {
  const bool line = std::any_of(args.begin(), args.end(), [](const std::string& argument) {
    return argument.starts_with("--events");
  });
  if (line) return run_plc_line(args);
  PlcRun run;
  if (!read_arguments(args, run)) return 0;
  PlcClient client(run.client);
  if (!client.connect()) give_up(client);
  const bool job = is_job(run.command.code);
  if (!client.beat_if_due()) give_up(client);
  if (job && run.arm) arm(client);
  if (run.strict) return run_strict(client, run);
  const MonotonicClock clock;
  json results = json::array();
  bool all_answered = true;
  std::int64_t next_us = clock.now_us();
  for (std::int64_t i = 0; run.count == 0 || i < run.count; ++i) {
    if (i > 0) wait_until(client, next_us);
    next_us = std::max(next_us, clock.now_us() - run.interval_ms * 1000) + run.interval_ms * 1000;
    const Result<PlcAnswer> answer =
        client.run(run.command, static_cast<int>(run.answer_timeout_ms), job);
    if (!answer && answer.error().code != Code::NoFrameInTime) give_up(client);
    const bool answered = answer.ok() && answer.value().ack_code == Code::Accepted;
    all_answered = all_answered && answered;
    if (!answer) {
      std::cerr << client.problem() << "\n";
    } else if (run.as_json) {
      results.push_back(answer_json(answer.value(), run.command.part_tag));
    } else {
      print_answer(answer.value(), run.command.part_tag);
    }
    ++run.command.part_tag;
  }
  if (run.as_json) std::cout << json{{"results", results}} << "\n";
  return all_answered ? 0 : 1;
}

}  // namespace grapnel
