#pragma once

#include <functional>
#include <string>
#include <vector>

namespace grapnel::bench {

/// One line of the table: what is measured, and what it must and should take.
struct Row {
  std::string what;
  double must_ms = 0.0;  ///< 0: reported only
  double goal_ms = 0.0;
  std::function<void()> prepare;  ///< before every run, not measured
  std::function<void()> run;
};

/// CPU time of the calling thread, ms: other programs on the machine don't count.
[[nodiscard]] double thread_ms();

/// Median of `runs` of a row, ms.
[[nodiscard]] double median_ms(const Row& row, int runs);

/// CPU, compiler, SIMD target and date, as Markdown.
void print_machine();
/// Measures and prints the rows as a Markdown table.
void print_rows(const std::vector<Row>& rows, int runs);

}  // namespace grapnel::bench
