#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "base/input_error.h"
#include "workbench/commands.h"
#include "workbench/feature_csv.h"
#include "workbench/options.h"
#include "workbench/stage_run.h"

namespace grapnel {
namespace {

/// A feature matrix with its memory.
struct StoredFeatures {
  FeatureMatrix features;
  Block block;

  explicit StoredFeatures(const FeatureTable& table)
      : block(
            carve([&](Arena& arena) { features.reserve(arena, table.rows(), table.dimension); })) {
    features.rows = table.rows();
    for (std::size_t row = 0; row < table.rows(); ++row) {
      std::copy_n(table.bins.begin() + static_cast<std::ptrdiff_t>(row * table.dimension),
                  table.dimension, features.row(row).begin());
    }
  }
};

/// What a method's key may hold, for --help.
std::string choice_names(const Method<FeatureMatcher>& method, std::string_view key) {
  std::string names;
  for (const Field& field : method.fields()) {
    if (field.name != key) continue;
    for (const std::string_view choice : field.choices) {
      names += (names.empty() ? "" : ", ") + std::string(choice);
    }
  }
  return names;
}

}  // namespace

int run_match(std::span<const std::string> args) {
  std::string source_file;
  std::string target_file;
  std::string metric = "l2";
  double ratio = 1.0;
  bool mutual = false;
  bool json = false;
  const auto& method = find_method(feature_matchers(), "nearest_feature");
  Options options("match", "Pairs rows of two descriptor files whose bins are near.");
  options.positional("SOURCE.csv", source_file, "as describe writes it");
  options.positional("TARGET.csv", target_file, "as describe writes it");
  options.value("--metric", metric, "distance between rows: " + choice_names(method, "metric"));
  options.flag("--mutual", mutual, "only pairs that choose each other");
  options.number("--ratio", ratio, 0.0, 1.0, "largest ratio of nearest to second nearest distance");
  options.flag("--json", json, "one JSON object on stdout");
  if (!options.parse(args)) return 0;

  const FeatureTable source = load_feature_csv(source_file);
  const FeatureTable target = load_feature_csv(target_file);
  if (source.dimension != target.dimension) {
    throw InputError(target_file + ": " + std::to_string(target.dimension) + " bins; " +
                     source_file + " has " + std::to_string(source.dimension));
  }
  std::vector<std::string> overrides = {"max_ratio=" + std::to_string(ratio), "metric=" + metric};
  if (mutual) overrides.emplace_back("mutual=true");
  Limits limits = limits_for(std::max(source.rows(), target.rows()));
  limits.descriptor_dimension = source.dimension;
  LoadedStage<FeatureMatcher> matcher(feature_matchers(), "nearest_feature", overrides, limits);
  StoredFeatures source_rows(source);
  StoredFeatures target_rows(target);
  std::vector<Correspondence> storage(source.rows());
  Correspondences pairs{std::span<Correspondence>(storage)};
  require_ok(matcher->match(source_rows.features, target_rows.features, pairs), "match");
  storage.resize(pairs.size());
  for (Correspondence& pair : storage) {
    pair.source = static_cast<std::int32_t>(source.index[static_cast<std::size_t>(pair.source)]);
    pair.target = static_cast<std::int32_t>(target.index[static_cast<std::size_t>(pair.target)]);
  }
  print_correspondences(storage, json);
  return 0;
}

}  // namespace grapnel
