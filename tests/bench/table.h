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
  std::function<void()> peer = {};    ///< PCL's stage on the same input; empty = none to run
  std::function<void()> open3d = {};  ///< Open3D's
};

/// CPU time of the calling thread, ms: other programs on the machine don't count.
[[nodiscard]] double thread_ms();

/// Median of `runs` of a row, ms, after one that warms the caches.
[[nodiscard]] double median_ms(const Row& row, int runs);
/// The same of a peer of the row, CPU time of all threads, without a run to warm up where one takes
/// over 100 ms; 0 without one.
[[nodiscard]] double peer_ms(const Row& row, const std::function<void()>& peer, int runs);

/// CPU time of the whole program, ms: what a peer's threads take too.
[[nodiscard]] double program_ms();

/// Date, CPU, cores and their load, compiler, SIMD target and peers, as Markdown.
void print_machine();
/// Measures and prints the rows as a Markdown table.
void print_rows(const std::vector<Row>& rows, int runs);

}  // namespace grapnel::bench
