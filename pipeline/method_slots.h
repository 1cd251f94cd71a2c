#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/config.h"
#include "pipeline/registry.h"
#include "pipeline/stage.h"

namespace grapnel {

/// A step of a preset whose method is chosen by name: [table] method = "…".
template <class StageKind>
struct MethodSlot {
  const char* table = "";
  std::span<const Method<StageKind>> methods;
  std::string_view fallback;  ///< method of a preset that names none
  std::string_view defaults;  ///< TOML, [method] key = value: what this step asks of a method
  bool several = false;       ///< [[table]] may stand several times: one after the other
};

/// Every step whose method a preset chooses, in the pipeline's order.
struct MethodSlots {
  MethodSlot<NormalEstimator> normals;
  MethodSlot<KeypointDetector> keypoints;
  MethodSlot<DescriptorEstimator> descriptors;
  MethodSlot<FeatureMatcher> match;
  MethodSlot<CorrespondenceRejector> reject;
  MethodSlot<HypothesisGenerator> coarse;
  MethodSlot<PoseRefiner> refine_coarse;
  MethodSlot<PoseRefiner> refine;

  /// Calls `visit(slot)` for each.
  template <class Visit>
  void each(const Visit& visit) const {
    visit(normals);
    visit(keypoints);
    visit(descriptors);
    visit(match);
    visit(reject);
    visit(coarse);
    visit(refine_coarse);
    visit(refine);
  }
};
[[nodiscard]] MethodSlots method_slots() noexcept;

/// The keys that the step asks of a method, over the method's own defaults. May be empty.
[[nodiscard]] ConfigTable slot_defaults(std::string_view defaults, std::string_view method);

/// The method that the table names, or the slot's fallback. Throws InputError.
template <class StageKind>
[[nodiscard]] std::unique_ptr<StageKind> make_stage(const MethodSlot<StageKind>& slot,
                                                    const ConfigTable& table) {
  ConfigTable merged = table;
  const std::string name = ConfigReader(table).take_text("method", slot.fallback);
  const ConfigTable over = slot_defaults(slot.defaults, name);
  for (const auto& [key, value] : over.entries()) {
    if (merged.find(key) == nullptr) merged.set(key, value);
  }
  ConfigReader reader(merged);
  std::unique_ptr<StageKind> stage = make_method(slot.methods, reader, slot.fallback);
  reader.finish();
  return stage;
}

/// The methods of every table with the slot's name, one where there is none. Throws InputError.
template <class StageKind>
[[nodiscard]] std::vector<std::unique_ptr<StageKind>> make_stages(const MethodSlot<StageKind>& slot,
                                                                  ConfigReader& preset) {
  const ConfigTable empty("", slot.table, 0);
  std::vector<const ConfigTable*> tables = preset.take_tables(slot.table);
  if (tables.empty()) tables.push_back(&empty);
  if (tables.size() > 1 && !slot.several) {
    throw preset.problem(slot.table,
                         "one table is allowed, here are " + std::to_string(tables.size()));
  }
  std::vector<std::unique_ptr<StageKind>> stages;
  for (const ConfigTable* table : tables) stages.push_back(make_stage(slot, *table));
  return stages;
}

}  // namespace grapnel
