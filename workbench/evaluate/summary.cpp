#include "workbench/evaluate/summary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <map>
#include <set>
#include <string_view>
#include <vector>

#include "pipeline/registrar.h"
#include "workbench/evaluate/statistics.h"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

struct Tally {
  std::size_t cases = 0;
  std::size_t positives = 0;
  std::size_t negatives = 0;
  std::size_t either = 0;
  std::size_t errors = 0;
  std::size_t accepted_right = 0;
  std::size_t accepted_wrong = 0;
  std::size_t rejected_right = 0;
  std::size_t rejected_wrong = 0;
  std::size_t positives_accepted_right = 0;
  std::size_t raw_right = 0;

  void add(const CaseResult& result) {
    ++cases;
    positives += result.expect == Expect::Accept ? 1 : 0;
    negatives += result.expect == Expect::Reject ? 1 : 0;
    either += result.expect == Expect::Either ? 1 : 0;
    errors += result.failed() ? 1 : 0;
    raw_right += result.right ? 1 : 0;
    if (result.false_accept()) {
      ++accepted_wrong;
    } else if (result.accepted()) {
      ++accepted_right;
      positives_accepted_right += result.expect == Expect::Accept ? 1 : 0;
    } else if (result.expect == Expect::Accept || result.failed()) {
      ++rejected_wrong;
    } else {
      ++rejected_right;
    }
  }
};

Json ratio(std::size_t hits, std::size_t trials) {
  if (trials == 0) return nullptr;
  return static_cast<double>(hits) / static_cast<double>(trials);
}

Json interval_json(std::size_t hits, std::size_t trials) {
  const Interval interval = wilson_95(hits, trials);
  return {interval.low, interval.high};
}

void add_rates(const Tally& tally, Json& json) {
  json["recall"] = ratio(tally.positives_accepted_right, tally.positives);
  json["recall_95"] = interval_json(tally.positives_accepted_right, tally.positives);
  json["false_accept_rate"] = ratio(tally.accepted_wrong, tally.cases);
  json["false_accept_rate_upper_95"] = upper_bound_95(tally.accepted_wrong, tally.cases);
}

void add_counts(const Tally& tally, Json& json) {
  json["cases"] = tally.cases;
  json["positives"] = tally.positives;
  json["negatives"] = tally.negatives;
  json["either"] = tally.either;
  json["errors"] = tally.errors;
  json["accepted_right"] = tally.accepted_right;
  json["accepted_wrong"] = tally.accepted_wrong;
  json["rejected_right"] = tally.rejected_right;
  json["rejected_wrong"] = tally.rejected_wrong;
  json["raw_right"] = tally.raw_right;
}

Json error_json(const std::vector<double>& values) {
  return {{"median", quantile(values, 0.5)},
          {"p90", quantile(values, 0.9)},
          {"max", quantile(values, 1.0)}};
}

Json time_json(const std::vector<double>& values) {
  return {{"p50", quantile(values, 0.5)},
          {"p99", quantile(values, 0.99)},
          {"max", quantile(values, 1.0)}};
}

void add_errors(std::span<const CaseResult> results, Json& json) {
  std::vector<double> translation_m;
  std::vector<double> rotation_rad;
  for (const CaseResult& result : results) {
    if (!result.accepted() || !result.error) continue;
    translation_m.push_back(result.error->mean_displacement_m);
    rotation_rad.push_back(result.error->rotation_rad);
  }
  json["translation_m"] = error_json(translation_m);
  json["rotation_rad"] = error_json(rotation_rad);
}

/// Mean over the right accepted poses, per axis; null where no pose of the kind was measured.
void add_consistency(std::span<const CaseResult> results, Json& json) {
  constexpr std::array<const char*, 6> kAxes = {"x", "y", "z", "rx", "ry", "rz"};
  Json nees = Json::object();
  std::size_t poses = 0;
  for (const CaseResult& result : results) poses += result.accepted() && result.nees ? 1 : 0;
  for (std::size_t i = 0; i < kAxes.size(); ++i) {
    double sum = 0.0;
    std::size_t known = 0;
    for (const CaseResult& result : results) {
      if (!result.accepted() || !result.nees || !std::isfinite((*result.nees)[i])) continue;
      sum += (*result.nees)[i];
      ++known;
    }
    nees[kAxes[i]] = known == 0 ? Json(nullptr) : Json(sum / static_cast<double>(known));
  }
  nees["poses"] = poses;
  json["nees"] = nees;
}

void add_times(std::span<const CaseResult> results, Json& json) {
  std::vector<double> total_ms;
  std::vector<std::vector<double>> stage_ms(static_cast<std::size_t>(Stage::kCount));
  std::size_t peak_bytes = 0;
  for (const CaseResult& result : results) {
    if (result.failed()) continue;
    total_ms.push_back(result.answer.total_ms);
    peak_bytes = std::max(peak_bytes, result.answer.peak_bytes);
    for (std::size_t i = 0; i < stage_ms.size(); ++i) {
      stage_ms[i].push_back(static_cast<double>(result.answer.stage_us[i]) / 1000.0);
    }
  }
  json["total_ms"] = time_json(total_ms);
  Json stages = Json::object();
  for (auto i = static_cast<std::size_t>(Stage::Organize);
       i <= static_cast<std::size_t>(Stage::Judge); ++i) {
    stages[stage_name(static_cast<Stage>(i))] = time_json(stage_ms[i]);
  }
  json["stage_ms"] = stages;
  json["peak_bytes"] = peak_bytes;
}

/// Cases of one group are not independent, so the rates are also given per group, and as a bound
/// over groups: a group with any false accept counts once, one whose positives were all accepted
/// right is a success, a case without group is its own.
void add_groups(std::span<const CaseResult> results, Json& json) {
  std::vector<std::string> order;
  std::map<std::string, Tally> groups;
  std::size_t alone = 0;
  std::size_t alone_wrong = 0;
  std::size_t positive = 0;
  std::size_t all_right = 0;
  for (const CaseResult& result : results) {
    if (result.group.empty()) {
      ++alone;
      alone_wrong += result.false_accept() ? 1 : 0;
      const bool wanted = result.expect == Expect::Accept;
      positive += wanted ? 1 : 0;
      all_right += wanted && result.accepted() && result.right ? 1 : 0;
      continue;
    }
    if (!groups.contains(result.group)) order.push_back(result.group);
    groups[result.group].add(result);
  }
  Json list = Json::object();
  std::size_t wrong = alone_wrong;
  for (const std::string& name : order) {
    Json entry;
    add_counts(groups[name], entry);
    add_rates(groups[name], entry);
    list[name] = entry;
    const Tally& tally = groups[name];
    wrong += tally.accepted_wrong > 0 ? 1 : 0;
    positive += tally.positives > 0 ? 1 : 0;
    const bool complete = tally.positives_accepted_right == tally.positives;
    all_right += tally.positives > 0 && complete ? 1 : 0;
  }
  const std::size_t independent = alone + order.size();
  json["independent_groups"] = independent;
  json["false_accept_groups"] = wrong;
  json["false_accept_group_rate_upper_95"] = upper_bound_95(wrong, independent);
  json["positive_groups"] = positive;
  json["positive_groups_all_right"] = all_right;
  json["positive_groups_all_right_95"] = interval_json(all_right, positive);
  json["groups"] = list;
}

/// What the verdict made of right poses, wrong ones and none, by what was expected: each count with
/// the cases it is of.
Json confusion_json(std::span<const CaseResult> results) {
  Json rows = Json::array();
  for (const Expect expect : {Expect::Accept, Expect::Either, Expect::Reject}) {
    for (const char* pose : {"right", "wrong", "none"}) {
      std::size_t of_status[3] = {};
      for (const CaseResult& result : results) {
        const bool none = !result.answer.report.has_pose;
        const char* found = none ? "none" : result.right ? "right" : "wrong";
        if (result.expect != expect || std::string_view(found) != pose) continue;
        ++of_status[static_cast<std::size_t>(result.answer.status)];
      }
      const std::size_t sum = of_status[0] + of_status[1] + of_status[2];
      if (sum == 0) continue;
      rows.push_back({{"expect", expect_name(expect)},
                      {"pose", pose},
                      {"cases", sum},
                      {"accepted", of_status[0]},
                      {"rejected", of_status[1]},
                      {"error", of_status[2]}});
    }
  }
  return rows;
}

Json codes_json(std::span<const CaseResult> results) {
  std::map<unsigned, std::size_t> counts;
  for (const CaseResult& result : results) ++counts[static_cast<unsigned>(result.answer.code)];
  Json json = Json::object();
  for (const auto& [code, count] : counts) json[std::to_string(code)] = count;
  return json;
}

}  // namespace

Json summarise(std::span<const CaseResult> results) {
  Tally tally;
  for (const CaseResult& result : results) tally.add(result);
  Json json;
  add_counts(tally, json);
  add_rates(tally, json);
  add_errors(results, json);
  add_consistency(results, json);
  add_times(results, json);
  json["codes"] = codes_json(results);
  json["confusion"] = confusion_json(results);
  add_groups(results, json);
  return json;
}

Json summary_of(const Suite& suite, std::span<const CaseResult> results) {
  std::vector<std::string> order;
  std::map<std::string, std::vector<CaseResult>> by_preset;
  for (const CaseResult& result : results) {
    if (!by_preset.contains(result.preset)) order.push_back(result.preset);
    by_preset[result.preset].push_back(result);
  }
  Json presets = Json::object();
  for (const std::string& preset : order) presets[preset] = summarise(by_preset[preset]);
  Json json;
  json["suite"] = suite.name;
  json["tolerance_m"] = suite.tolerance_m;
  json["tolerance_rad"] = suite.tolerance_rad;
  json["simd"] = Registrar::simd_target();
  json["presets"] = presets;
  return json;
}

void print_summary(const Json& summary) {
  for (const auto& [name, p] : summary["presets"].items()) {
    std::cout << name << ": " << p["cases"] << " cases, accepted right " << p["accepted_right"]
              << ", false accepts " << p["accepted_wrong"] << ", rejected right "
              << p["rejected_right"] << ", missed " << p["rejected_wrong"] << ", errors "
              << p["errors"] << ", right before the verdict " << p["raw_right"] << "\n";
  }
}

}  // namespace grapnel
