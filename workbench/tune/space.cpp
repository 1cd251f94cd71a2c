#include "workbench/tune/space.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "base/config_text.h"
#include "base/input_error.h"
#include "base/rng.h"
#include "pipeline/preset.h"
#include "workbench/presets.h"

namespace grapnel {
namespace {

constexpr std::size_t kMostDraws = 10000;
// Draws in vain, for each one wanted.
constexpr std::size_t kPatience = 20;

bool is_method(const std::string& key) { return key.ends_with(".method"); }

/// Adds the keys of a table and of the tables in it.
void add_keys(const ConfigTable& table, const std::string& path, std::vector<SpaceKey>& keys) {
  const ConfigReader reader(table);
  for (const auto& [name, value] : table.entries()) {
    const std::string key = path.empty() ? name : path + "." + name;
    if (const auto* tables = std::get_if<std::vector<ConfigTable>>(&value.data)) {
      for (const ConfigTable& inner : *tables) add_keys(inner, key, keys);
      continue;
    }
    const auto* values = std::get_if<std::vector<ConfigValue>>(&value.data);
    if (values == nullptr || values->empty()) {
      throw reader.problem(name, "a list of the values to be tried is expected");
    }
    SpaceKey entry{key, {}, value.line};
    for (const ConfigValue& one : *values) entry.values.push_back(toml_text(one));
    keys.push_back(std::move(entry));
  }
}

/// A combination as a place in each key's list.
using Places = std::vector<std::size_t>;

/// Why the base does not become a preset by it; nothing where it does.
std::optional<std::string> refusal(const std::filesystem::path& base,
                                   const Combination& combination) {
  try {
    static_cast<void>(load_preset(base, models_folder(base), combination));
  } catch (const InputError& error) {
    return error.what();
  }
  return std::nullopt;
}

/// Number of combinations, at most `limit` + 1.
std::size_t count_of(const Space& space, std::size_t limit) {
  std::size_t count = 1;
  for (const SpaceKey& key : space.keys) count = std::min(count * key.values.size(), limit + 1);
  return count;
}

/// The i-th of all combinations; the last key changes fastest.
Places places_of(const Space& space, std::size_t i) {
  Places places(space.keys.size());
  for (std::size_t k = space.keys.size(); k-- > 0;) {
    places[k] = i % space.keys[k].values.size();
    i /= space.keys[k].values.size();
  }
  return places;
}

Places draw(const Space& space, Rng& rng) {
  Places places;
  for (const SpaceKey& key : space.keys) {
    places.push_back(rng.below(static_cast<std::uint32_t>(key.values.size())));
  }
  return places;
}

/// What became of each value: allowed in some combination, or why not.
class Verdicts {
 public:
  explicit Verdicts(const Space& space) : space_(space), of_(space.keys.size()) {
    for (std::size_t k = 0; k < of_.size(); ++k) of_[k].resize(space.keys[k].values.size());
  }
  void add(std::size_t key, std::size_t place, const std::optional<std::string>& refused) {
    Value& value = of_[key][place];
    if (!refused) value.allowed = true;
    if (refused && value.reason.empty()) value.reason = *refused;
  }
  void require_every_value() const {
    for (std::size_t k = 0; k < of_.size(); ++k) {
      for (std::size_t i = 0; i < of_[k].size(); ++i) {
        if (of_[k][i].allowed || of_[k][i].reason.empty()) continue;
        const SpaceKey& key = space_.keys[k];
        throw InputError(space_.file + ":" + std::to_string(key.line) + ": " + key.key + " = " +
                         key.values[i] + " is allowed in no combination: " + of_[k][i].reason);
      }
    }
  }

 private:
  struct Value {
    bool allowed = false;
    std::string reason;
  };
  const Space& space_;
  std::vector<std::vector<Value>> of_;
};

/// The values at the places, but those that the base does not allow with the ones before them, as a
/// key of another method.
Combination combination_at(const Space& space, const std::filesystem::path& base,
                           const Places& places, Verdicts& verdicts) {
  Combination combination;
  for (std::size_t k = 0; k < space.keys.size(); ++k) {
    combination.push_back(space.keys[k].key + "=" + space.keys[k].values[places[k]]);
    const std::optional<std::string> refused = refusal(base, combination);
    verdicts.add(k, places[k], refused);
    if (refused) combination.pop_back();
  }
  return combination;
}

}  // namespace

Space load_space(const std::filesystem::path& file) {
  const ConfigTable table = load_config(file);
  ConfigReader reader(table);
  Space space;
  space.file = file.string();
  space.base = reader.take_text("base", "");
  space.draws = static_cast<std::size_t>(
      reader.take_integer("draws", 1, kMostDraws, static_cast<std::int64_t>(space.draws)));
  space.seed = static_cast<std::uint64_t>(reader.take_integer("seed", 0, INT64_MAX, 1));
  reader.require("keys");
  add_keys(*reader.take_table("keys"), "", space.keys);
  reader.finish();
  std::stable_partition(space.keys.begin(), space.keys.end(),
                        [](const SpaceKey& key) { return is_method(key.key); });
  return space;
}

std::vector<Combination> combinations(const Space& space, const std::filesystem::path& base) {
  const std::size_t all = count_of(space, space.draws);
  const bool drawn = all > space.draws;
  const std::size_t most = drawn ? kPatience * space.draws : all;
  Rng rng(space.seed);
  std::set<Combination> seen;
  std::vector<Combination> found;
  Verdicts verdicts(space);
  for (std::size_t i = 0; i < most && found.size() < space.draws; ++i) {
    const Places places = drawn ? draw(space, rng) : places_of(space, i);
    Combination combination = combination_at(space, base, places, verdicts);
    if (seen.insert(combination).second) found.push_back(std::move(combination));
  }
  verdicts.require_every_value();
  return found;
}

}  // namespace grapnel
