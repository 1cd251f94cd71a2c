#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/rng.h"
#include "workbench/evaluate/case_result.h"

namespace grapnel {

/// What a preset made of the cases it has run on.
struct Tally {
  std::size_t cases = 0;
  std::size_t accepted_wrong = 0;
  std::size_t failed = 0;  ///< ended with an error
  std::size_t accepted_right = 0;
  std::size_t found = 0;        ///< right poses, accepted or not
  std::vector<double> error_m;  ///< of the right poses
  std::vector<double> total_ms;

  void add(const CaseResult& result);
};

/// Whether one is better: fewer wrong poses accepted, then fewer failures, more right poses
/// accepted, more found, less error of those. Times don't count, so that a race ends the same way
/// on any machine. Precondition: both have run on the same cases.
[[nodiscard]] bool better(const Tally& a, const Tally& b);

/// Runs a contestant on cases; the results in the order of the pairs (contestant, case).
struct Heat {
  std::size_t contestant = 0;
  std::size_t case_i = 0;
};
using RunHeats = std::function<std::vector<CaseResult>(std::span<const Heat> heats)>;

/// How the race stood when a contestant left it, or at its end.
struct Standing {
  std::size_t contestant = 0;
  Tally tally;
};

/// Races contestants 0…count - 1 over the cases: all run on some, the better half on twice as many,
/// and so on (successive halving); those that are left run on all. Contestant 0 stays to the end,
/// for comparison. Cases of one group stay together, so that none is favoured by a lucky draw of
/// alike ones. Returns those left at the end, best first.
[[nodiscard]] std::vector<Standing> race(std::size_t count, std::span<const SuiteCase> cases,
                                         Rng rng, const RunHeats& run);

}  // namespace grapnel
