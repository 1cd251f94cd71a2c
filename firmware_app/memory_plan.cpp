#include "firmware_app/memory_plan.h"

#include <algorithm>
#include <cstdio>
#include <set>
#include <string>

#include "base/arena.h"
#include "firmware_app/background.h"
#include "firmware_app/job_evidence.h"
#include "firmware_app/preset_source.h"
#include "firmware_app/realtime.h"
#include "hal/frame_pool.h"

namespace grapnel {
namespace {

// Threads with a stack of Thread's size: registration, field bus, config, camera,
// snapshots, recorder.
constexpr std::size_t kThreads = 6;

void print_items(const std::vector<MemoryItem>& items) {
  for (const MemoryItem& item : items) {
    std::printf("  %-32s %12zu\n", item.part.c_str(), item.bytes);
  }
}

/// Every preset number that has a file, ascending as the folder's names sort.
std::vector<std::uint16_t> preset_numbers(const Settings& settings) {
  std::vector<std::uint16_t> numbers;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(settings.presets_folder(), error)) {
    const std::string name = entry.path().filename().string();
    if (!name.ends_with(".toml")) continue;
    std::size_t digits = 0;
    while (digits < name.size() && name[digits] >= '0' && name[digits] <= '9') ++digits;
    if (digits == 0 || digits > 3 || name[digits] != '-') continue;
    const int number = std::stoi(name.substr(0, digits));
    if (number > 0) numbers.push_back(static_cast<std::uint16_t>(number));
  }
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

bool check_preset(const Settings& settings, std::uint16_t number, bool active,
                  std::set<std::string>& problems) {
  try {
    const Preset preset = read_preset(settings, number);
    if (preset.models.empty()) return true;
    const std::vector<MemoryItem> plan = Registrar::plan(preset);
    const std::size_t sum = total_bytes(plan);
    const std::size_t budget = settings.preset_budget_bytes();
    if (active) {
      std::printf("preset %u %s, bytes\n", static_cast<unsigned>(number), preset.name.c_str());
      print_items(plan);
      std::printf("  %-32s %12zu of %zu\n", "sum", sum, budget);
    } else {
      std::printf("preset %u %s: %zu of %zu bytes\n", static_cast<unsigned>(number),
                  preset.name.c_str(), sum, budget);
    }
    if (sum <= budget) return true;
    problems.insert(preset.file.string() + ": needs " + std::to_string(sum) +
                    " bytes, the budget of one preset is " + std::to_string(budget) +
                    " (half of memory.budget_mb)");
  } catch (const InputError& problem) {
    problems.insert(problem.what());
  }
  return false;
}

}  // namespace

std::size_t background_bytes(const Settings& settings) {
  Arena arena;
  Background background;
  background.reserve(arena, settings.capture.max_width, settings.capture.max_height,
                     settings.belt.learn_frames);
  return arena.used_bytes();
}

std::size_t evidence_bytes(const Settings& settings) {
  Arena arena;
  EvidenceSlot slot;
  slot.reserve(arena, settings.capture.max_width, settings.capture.max_height,
               settings.capture.color);
  return arena.used_bytes();
}

std::vector<MemoryItem> fixed_memory_plan(const Settings& settings) {
  const CaptureSettings& capture = settings.capture;
  const FramePool pool(static_cast<std::size_t>(capture.pool_frames), capture.max_width,
                       capture.max_height, capture.color);
  return {{"block of two presets", 2 * settings.preset_budget_bytes()},
          {"frame pool", pool.bytes()},
          {"taught background", background_bytes(settings)},
          {"job to be saved", evidence_bytes(settings)},
          {"stacks", kThreads * Thread::kStackBytes}};
}

std::size_t total_bytes(const std::vector<MemoryItem>& items) {
  std::size_t sum = 0;
  for (const MemoryItem& item : items) sum += item.bytes;
  return sum;
}

int run_check(const Settings& settings) {
  std::set<std::string> problems;  // one in grapnel.toml shows in every preset, and is told once
  const auto active = static_cast<std::uint16_t>(settings.general.active_preset);
  bool well = check_preset(settings, active, true, problems);
  for (const std::uint16_t number : preset_numbers(settings)) {
    if (number != active && !check_preset(settings, number, false, problems)) well = false;
  }
  for (const std::string& problem : problems) std::fprintf(stderr, "%s\n", problem.c_str());
  const std::vector<MemoryItem> fixed = fixed_memory_plan(settings);
  std::printf("memory taken at start, bytes\n");
  print_items(fixed);
  std::printf("  %-32s %12zu\n", "sum", total_bytes(fixed));
  std::printf("%s\n", well ? "all is well" : "problems were found");
  return well ? 0 : 1;
}

}  // namespace grapnel
