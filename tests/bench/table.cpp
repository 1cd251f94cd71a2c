#include "tests/bench/table.h"

#include <time.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <thread>

#include "pipeline/kernels/target.h"
#include "tests/bench/peers/open3d.h"
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

std::string peer_names() {
  std::string both;
  for (const char* const name : {peers::name(), peers::o3d::name()}) {
    if (std::string(name) != "none") both += both.empty() ? name : std::string(", ") + name;
  }
  return both.empty() ? "none" : both;
}

const char* verdict(const Row& row, double ms) {
  if (row.must_ms <= 0.0) return "";
  if (ms <= row.goal_ms) return "goal met";
  return ms <= row.must_ms ? "must met" : "missed";
}

double ms_of(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double timed_ms(double (*clock)(), const std::function<void()>& run) {
  const double before = clock();
  run();
  return clock() - before;
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

double thread_ms() { return ms_of(CLOCK_THREAD_CPUTIME_ID); }

double program_ms() { return ms_of(CLOCK_PROCESS_CPUTIME_ID); }

double median_ms(const Row& row, int runs) {
  std::vector<double> times;
  // The first run warms the caches.
  for (int i = 0; i <= runs; ++i) {
    if (row.prepare) row.prepare();
    const double ms = timed_ms(thread_ms, row.run);
    if (i > 0) times.push_back(ms);
  }
  return middle(times);
}

double peer_ms(const Row& row, const std::function<void()>& peer, int runs) {
  if (!peer) return 0.0;
  if (row.prepare) row.prepare();
  const double first = timed_ms(program_ms, peer);
  std::vector<double> times;
  if (first > kSlow_ms) {
    times.push_back(first);
    runs = kSlowRuns - 1;
  }
  for (int i = 0; i < runs; ++i) times.push_back(timed_ms(program_ms, peer));
  return middle(times);
}

void print_machine() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> date{};
  (void)std::strftime(date.data(), date.size(), "%Y-%m-%d %H:%M UTC", &utc);
  double load = 0.0;
  (void)getloadavg(&load, 1);
  std::printf("%s. %s, %u cores in sight asked for by %.1f programs, g++ %s, SIMD target %s.\n",
              date.data(), cpu_name().c_str(), std::thread::hardware_concurrency(), load,
              __VERSION__, kernels::target_name());
  std::printf("Peers: %s. One thread, CPU time, medians.\n\n", peer_names().c_str());
}

void print_rows(const std::vector<Row>& rows, int runs) {
  std::printf("| what | ms | must | goal | | PCL, ms | ratio | Open3D, ms | ratio |\n");
  std::printf("|---|---|---|---|---|---|---|---|---|\n");
  for (const Row& row : rows) {
    const double ms = median_ms(row, runs);
    std::printf("| %s | %s |", row.what.c_str(), number(ms).c_str());
    if (row.must_ms > 0.0) {
      std::printf(" %g | %g | %s |", row.must_ms, row.goal_ms, verdict(row, ms));
    } else {
      std::printf(" | | |");
    }
    for (const auto* const peer : {&row.peer, &row.open3d}) {
      const double theirs = peer_ms(row, *peer, runs);
      if (theirs > 0.0) {
        std::printf(" %s | %.*f |", number(theirs).c_str(), theirs < 2.0 * ms ? 1 : 0, theirs / ms);
      } else {
        std::printf(" | |");
      }
    }
    std::printf("\n");
    std::fflush(stdout);
  }
  std::printf("\n");
}

}  // namespace grapnel::bench
