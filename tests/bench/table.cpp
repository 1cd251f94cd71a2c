#include "tests/bench/table.h"

#include <time.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <thread>

#include "pipeline/kernels/target.h"
#include "tests/bench/peers/peers.h"

namespace grapnel::bench {
namespace {

/// A peer slower than this is neither warmed up nor run more than three times.
constexpr double kSlow_ms = 100.0;
constexpr int kSlowRuns = 3;

std::string cpu_name() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

const char* verdict(const Row& row, double ms) {
  if (row.must_ms <= 0.0) return "";
  if (ms <= row.goal_ms) return "goal met";
  return ms <= row.must_ms ? "must met" : "missed";
}

double timed_ms(const std::function<void()>& prepare, const std::function<void()>& run) {
  if (prepare) prepare();
  const double before = thread_ms();
  run();
  return thread_ms() - before;
}

double middle(std::vector<double> times) {
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(),
                value < 10.0    ? "%.2f"
                : value < 100.0 ? "%.1f"
                                : "%.0f",
                value);
  return text.data();
}

}  // namespace

double thread_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double median_ms(const Row& row, int runs) {
  std::vector<double> times;
  (void)timed_ms(row.prepare, row.run);
  for (int i = 0; i < runs; ++i) times.push_back(timed_ms(row.prepare, row.run));
  return middle(times);
}

double peer_ms(const Row& row, int runs) {
  if (!row.peer) return 0.0;
  if (row.prepare) row.prepare();
  const double first = timed_ms({}, row.peer);
  std::vector<double> times;
  if (first > kSlow_ms) {
    times.push_back(first);
    runs = kSlowRuns - 1;
  }
  for (int i = 0; i < runs; ++i) times.push_back(timed_ms({}, row.peer));
  return middle(times);
}

void print_machine() {
  std::printf("%s, %u cores in sight, g++ %s, SIMD target %s; peer: %s. One thread, CPU time,",
              cpu_name().c_str(), std::thread::hardware_concurrency(), __VERSION__,
              kernels::target_name(), peers::name());
  std::printf(" medians.\n\n");
}

void print_rows(const std::vector<Row>& rows, int runs) {
  std::printf("| what | ms | must | goal | | PCL, ms | ratio |\n|---|---|---|---|---|---|---|\n");
  for (const Row& row : rows) {
    const double ms = median_ms(row, runs);
    const double theirs = peer_ms(row, runs);
    std::printf("| %s | %s |", row.what.c_str(), number(ms).c_str());
    if (row.must_ms > 0.0) {
      std::printf(" %g | %g | %s |", row.must_ms, row.goal_ms, verdict(row, ms));
    } else {
      std::printf(" | | |");
    }
    if (theirs > 0.0) {
      std::printf(" %s | %.0f |\n", number(theirs).c_str(), theirs / ms);
    } else {
      std::printf(" | |\n");
    }
    std::fflush(stdout);
  }
  std::printf("\n");
}

}  // namespace grapnel::bench
