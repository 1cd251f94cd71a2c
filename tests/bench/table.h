#pragma once

#include <functional>
#include <string>
#include <vector>

namespace grapnel::bench {

/// One line of the table: what is measured, what it must and should take, and who else does it.
struct Row {
  std::string what;
  double must_ms = 0.0;  ///< 0: reported only
  double goal_ms = 0.0;
  std::function<void()> prepare;  ///< before every run, not measured
  std::function<void()> run;
  std::function<void()> peer = {};  ///< PCL's stage on the same input; empty = none to run
};

/// CPU time of the calling thread, ms: other programs on the machine don't count.
[[nodiscard]] double thread_ms();

/// Median of `runs` of a row, ms, after one that warms the caches.
[[nodiscard]] double median_ms(const Row& row, int runs);
/// The same of the row's peer, without a run to warm up where one takes over 100 ms; 0 without one.
[[nodiscard]] double peer_ms(const Row& row, int runs);

/// CPU, cores, compiler, build and SIMD target, as Markdown.
void print_machine();
/// Measures and prints the rows as a Markdown table.
void print_rows(const std::vector<Row>& rows, int runs);

}  // namespace grapnel::bench
