#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "base/input_error.h"
#include "drivers/registry.h"
#include "firmware_app/memory_plan.h"
#include "firmware_app/settings.h"
#include "workbench/commands.h"
#include "workbench/doctor/checks.h"
#include "workbench/options.h"

namespace grapnel {
namespace {

Diagnosis check_sensor(const Settings& settings) {
  const char* const cure =
      "grapneld --list-cameras shows what each driver sees; is another program "
      "or the daemon itself using the camera?";
  try {
    const MonotonicClock clock;
    const std::unique_ptr<Camera> camera = make_camera(settings.camera, clock);
    const Result<CameraInfo> info = camera->open();
    if (!info) return {"sensor", Finding::Bad, camera->problem(), cure};
    const std::string found =
        info.value().driver + " " + info.value().model + " " + info.value().serial + " opens";
    camera->close();
    return {"sensor", Finding::Well, found, ""};
  } catch (const InputError& problem) {
    return {"sensor", Finding::Bad, problem.what(),
            "correct [camera]; grapneld --list-cameras shows the drivers and what each sees"};
  }
}

std::vector<Diagnosis> look(const std::optional<std::string>& config) {
  Settings settings;
  std::vector<Diagnosis> found;
  if (config) {
    settings = load_settings(*config, {});
    found.push_back(check_sensor(settings));
  }
  const SystemRoots roots;
  for (Diagnosis& usb : check_usb(roots)) found.push_back(std::move(usb));
  const RealtimeSettings& realtime = settings.realtime;
  found.push_back(
      check_realtime(std::max(realtime.capture_priority, realtime.registration_priority)));
  found.push_back(check_memory_lock(total_bytes(fixed_memory_plan(settings))));
  found.push_back(check_disk(config ? settings.state_folder() : std::filesystem::path(".")));
  found.push_back(check_clock(roots));
  if (config) {
    found.push_back(check_modbus(settings.fieldbus.listen_address, settings.fieldbus.port));
  }
  return found;
}

const char* word_of(Finding finding) {
  if (finding == Finding::Well) return "ok";
  return finding == Finding::Warning ? "warning" : "bad";
}

}  // namespace

int run_doctor(std::span<const std::string> args) {
  std::vector<std::string> config;
  bool json = false;
  Options options("doctor",
                  "Looks for what keeps the appliance from working, with cause and cure.");
  options.positionals("CONFIG", config, 0,
                      "grapnel.toml; without it sensor and field bus are left out");
  options.flag("--json", json, "print one JSON object");
  options.footer("Exit code: 0 nothing bad, 1 something is. Run it as the daemon's user.");
  if (!options.parse(args)) return 0;
  if (config.size() > 1) throw InputError("CONFIG: one grapnel.toml is allowed");
  const std::vector<Diagnosis> found =
      look(config.empty() ? std::nullopt : std::optional(config.front()));
  nlohmann::ordered_json checks = nlohmann::ordered_json::array();
  for (const Diagnosis& diagnosis : found) {
    if (json) {
      checks.push_back({{"subject", diagnosis.subject},
                        {"finding", word_of(diagnosis.finding)},
                        {"cause", diagnosis.cause},
                        {"cure", diagnosis.cure}});
      continue;
    }
    std::cout << word_of(diagnosis.finding) << ": " << diagnosis.subject << ": " << diagnosis.cause
              << "\n";
    if (!diagnosis.cure.empty()) std::cout << "    " << diagnosis.cure << "\n";
  }
  if (json) std::cout << nlohmann::ordered_json{{"checks", checks}}.dump() << "\n";
  const bool bad = std::any_of(found.begin(), found.end(), [](const Diagnosis& diagnosis) {
    return diagnosis.finding == Finding::Bad;
  });
  return bad ? 1 : 0;
}

}  // namespace grapnel
