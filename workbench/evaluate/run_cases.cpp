#include "workbench/evaluate/run_cases.h"

#include <algorithm>
#include <atomic>
#include <numeric>
#include <thread>
#include <tuple>

#include "workbench/progress.h"

namespace grapnel {
namespace {

/// Registrars kept by a thread: cases come ordered by their model.
constexpr std::size_t kKeptRegistrars = 2;

/// Indices of all runs, those of one preset and source next to each other.
std::vector<std::size_t> order_of(std::span<const CaseRun> runs) {
  std::vector<std::size_t> order(runs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto key = [&](std::size_t i) {
    return std::tie(runs[i].preset, runs[i].overrides, runs[i].one->source);
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  return order;
}

}  // namespace

std::vector<CaseResult> run_cases(const Suite& suite, std::span<const CaseRun> runs,
                                  std::size_t jobs, const std::string& what) {
  std::vector<CaseResult> results(runs.size());
  const std::vector<std::size_t> order = order_of(runs);
  std::atomic<std::size_t> next{0};
  Progress progress(what, results.size());
  const auto work = [&] {
    RegistrarStore store(kKeptRegistrars);
    for (std::size_t turn = next++; turn < order.size(); turn = next++) {
      const CaseRun& run = runs[order[turn]];
      results[order[turn]] = run_case(suite, *run.one, run.preset, store, run.overrides);
      progress.step();
    }
  };
  std::vector<std::jthread> threads;
  for (std::size_t i = 1; i < jobs; ++i) threads.emplace_back(work);
  work();
  threads.clear();
  return results;
}

}  // namespace grapnel
