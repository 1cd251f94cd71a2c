#include "tests/bench/table.h"

#include <sys/utsname.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>

#include "pipeline/kernels/target.h"

namespace grapnel::bench {
namespace {

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

}  // namespace

double thread_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double median_ms(const Row& row, int runs) {
  std::vector<double> times;
  for (int i = 0; i < runs + 1; ++i) {
    if (row.prepare) row.prepare();
    const double before = thread_ms();
    row.run();
    // The first run warms the caches.
    if (i > 0) times.push_back(thread_ms() - before);
  }
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

void print_machine() {
  std::array<char, 32> date{};
  const time_t now = time(nullptr);
  tm local{};
  localtime_r(&now, &local);
  strftime(date.data(), date.size(), "%Y-%m-%d", &local);
  std::printf("%s, g++ %s, SIMD target %s, %s. One thread, CPU time, medians.\n\n",
              cpu_name().c_str(), __VERSION__, kernels::target_name(), date.data());
}

void print_rows(const std::vector<Row>& rows, int runs) {
  std::printf("| what | ms | must | goal | |\n|---|---|---|---|---|\n");
  for (const Row& row : rows) {
    const double ms = median_ms(row, runs);
    if (row.must_ms > 0.0) {
      std::printf("| %s | %.2f | %g | %g | %s |\n", row.what.c_str(), ms, row.must_ms, row.goal_ms,
                  verdict(row, ms));
    } else {
      std::printf("| %s | %.2f | | | |\n", row.what.c_str(), ms);
    }
    std::fflush(stdout);
  }
  std::printf("\n");
}

}  // namespace grapnel::bench
