#include "workbench/tune/race.h"

#include <algorithm>
#include <map>
#include <utility>

#include "workbench/evaluate/statistics.h"

namespace grapnel {
namespace {

constexpr std::size_t kFewestAtFirst = 8;
constexpr std::size_t kShareAtFirst = 8;  // one of so many cases
constexpr std::size_t kFewestLeft = 4;

/// Indices of the cases, groups in random order.
std::vector<std::size_t> shuffled(std::span<const SuiteCase> cases, Rng rng) {
  std::vector<std::vector<std::size_t>> groups;
  std::map<std::string, std::size_t> place;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const std::string& group = cases[i].group;
    if (!group.empty() && !place.try_emplace(group, groups.size()).second) {
      groups[place[group]].push_back(i);
    } else {
      groups.push_back({i});
    }
  }
  for (std::size_t i = groups.size(); i > 1; --i) {
    std::swap(groups[i - 1], groups[rng.below(static_cast<std::uint32_t>(i))]);
  }
  std::vector<std::size_t> order;
  for (const std::vector<std::size_t>& group : groups) {
    order.insert(order.end(), group.begin(), group.end());
  }
  return order;
}

void run_on(std::span<const std::size_t> cases, const RunHeats& run,
            std::vector<Standing>& standings) {
  std::vector<Heat> heats;
  for (const Standing& standing : standings) {
    for (const std::size_t i : cases) heats.push_back({standing.contestant, i});
  }
  const std::vector<CaseResult> results = run(heats);
  for (std::size_t i = 0; i < results.size(); ++i) {
    standings[i / cases.size()].tally.add(results[i]);
  }
}

/// Keeps the better half, and contestant 0.
void halve(std::vector<Standing>& standings) {
  const std::size_t kept = std::max(kFewestLeft, (standings.size() + 1) / 2);
  if (standings.size() <= kept) return;
  const auto first_out = standings.begin() + static_cast<std::ptrdiff_t>(kept);
  const auto base = std::find_if(standings.begin(), standings.end(),
                                 [](const Standing& s) { return s.contestant == 0; });
  if (base >= first_out) std::iter_swap(base, first_out - 1);
  standings.erase(first_out, standings.end());
}

}  // namespace

void Tally::add(const CaseResult& result) {
  ++cases;
  accepted_wrong += result.false_accept() ? 1U : 0U;
  failed += result.failed() ? 1U : 0U;
  total_ms.push_back(result.answer.total_ms);
  if (!result.right) return;
  ++found;
  accepted_right += result.accepted() && !result.false_accept() ? 1U : 0U;
  error_m.push_back(result.error ? result.error->mean_displacement_m : 0.0);
}

bool better(const Tally& a, const Tally& b) {
  if (a.accepted_wrong != b.accepted_wrong) return a.accepted_wrong < b.accepted_wrong;
  if (a.failed != b.failed) return a.failed < b.failed;
  if (a.accepted_right != b.accepted_right) return a.accepted_right > b.accepted_right;
  if (a.found != b.found) return a.found > b.found;
  return a.found > 0 && quantile(a.error_m, 0.5) < quantile(b.error_m, 0.5);
}

std::vector<Standing> race(std::size_t count, std::span<const SuiteCase> cases, Rng rng,
                           const RunHeats& run) {
  const std::vector<std::size_t> order = shuffled(cases, rng);
  std::vector<Standing> standings;
  for (std::size_t i = 0; i < count; ++i) standings.push_back({i, {}});
  std::size_t done = 0;
  std::size_t upto = std::max(kFewestAtFirst, (cases.size() + kShareAtFirst - 1) / kShareAtFirst);
  while (done < cases.size()) {
    upto = standings.size() <= kFewestLeft ? cases.size() : std::min(upto, cases.size());
    run_on(std::span(order).subspan(done, upto - done), run, standings);
    std::stable_sort(standings.begin(), standings.end(),
                     [](const Standing& a, const Standing& b) { return better(a.tally, b.tally); });
    done = upto;
    upto *= 2;
    if (done < cases.size()) halve(standings);
  }
  return standings;
}

}  // namespace grapnel
