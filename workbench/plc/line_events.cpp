#include "workbench/plc/line_events.h"

#include <fstream>

#include <nlohmann/json.hpp>

#include "base/input_error.h"

namespace grapnel {
namespace {

using nlohmann::json;

Expectation expectation_of(const std::string& text) {
  if (text == "empty") return Expectation::Empty;
  if (text == "wrong") return Expectation::Wrong;
  if (text == "accept") return Expectation::Accept;
  throw InputError("expected: \"" + text + "\"; \"accept\", \"empty\" or \"wrong\" is allowed");
}

LineEvent event_of(const json& row) {
  LineEvent event;
  event.id = row.at("id").get<std::uint32_t>();
  event.kind = row.at("kind").get<std::string>();
  event.model = row.at("model").get<std::string>();
  event.expected = expectation_of(row.at("expected").get<std::string>());
  event.first_frame = row.at("first_frame").get<std::int64_t>();
  event.last_frame = row.at("last_frame").get<std::int64_t>();
  event.trigger_frame = row.at("trigger_frame").get<std::int64_t>();
  if (event.expected != Expectation::Accept) return event;
  const auto numbers = row.at("camera_from_model").get<std::vector<double>>();
  if (numbers.size() != 16) throw InputError("camera_from_model: 16 numbers are allowed");
  for (int i = 0; i < 16; ++i) {
    event.camera_from_model.matrix()(i / 4, i % 4) = numbers[static_cast<std::size_t>(i)];
  }
  return event;
}

}  // namespace

LineScript load_line_script(const std::filesystem::path& events_file) {
  LineScript script;
  std::ifstream events(events_file);
  if (!events) throw InputError(events_file.string() + ": can't be read");
  int line = 0;
  for (std::string text; std::getline(events, text);) {
    ++line;
    try {
      script.events.push_back(event_of(json::parse(text)));
    } catch (const std::exception& problem) {
      throw InputError(events_file.string() + ":" + std::to_string(line) + ": " + problem.what());
    }
  }
  const std::filesystem::path objects_file = events_file.parent_path() / "objects.jsonl";
  std::ifstream objects(objects_file);
  for (std::string text; std::getline(objects, text);) ++script.frames;
  if (script.frames == 0) throw InputError(objects_file.string() + ": can't be read, or is empty");
  if (script.events.empty()) throw InputError(events_file.string() + ": no event");
  return script;
}

}  // namespace grapnel
