// The controlling client's answers while others misbehave. Counts are asserted; times are printed,
// because they are those of the machine.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <thread>
#include <vector>

#include "base/rng.h"
#include "tests/drivers/modbus/support/hand_driven_server.h"
#include "tests/drivers/modbus/support/server_thread.h"

namespace grapnel::test {
namespace {

using Time = std::chrono::steady_clock;

constexpr int kCycles = 1500;
constexpr int kIdleClients = 50;
constexpr int kNuisancePlaces = 4;

const Bytes kStatusRead = make_adu(1, 1, {4, 0, 100, 0, 80});

/// Connects again whenever the server has closed it, and runs `act` on the connection.
template <class Act>
std::thread nuisance(std::uint16_t port, const std::string& source, std::atomic<bool>& stop,
                     std::atomic<int>& connections, Act act) {
  return std::thread([port, source, &stop, &connections, act] {
    Rng rng(connections.load() + 1);
    while (!stop) {
      RawClient client(port, source, 2048);
      ++connections;
      while (!stop && !client.closed_by_server()) {
        act(client, rng);
      }
    }
  });
}

void pause_ms(int duration_ms) {
  std::this_thread::sleep_for(std::chrono::milliseconds(duration_ms));
}

void dribble(RawClient& client, Rng& rng) {
  client.send({kStatusRead[rng.below(static_cast<std::uint32_t>(kStatusRead.size()))]});
  pause_ms(5);
  client.receive();
}

void send_garbage(RawClient& client, Rng& rng) {
  Bytes bytes(1 + rng.below(300));
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(rng.below(256));
  client.send(bytes);
  pause_ms(2);
  client.receive();
}

// Asks for the longest answers and takes none.
void never_read(RawClient& client, Rng&) {
  client.send(make_adu(1, 1, {4, 0, 100, 0, 125}));
  pause_ms(1);
}

double percentile_ms(std::vector<double>& times_ms, double share) {
  std::sort(times_ms.begin(), times_ms.end());
  const auto at = static_cast<std::size_t>(share * static_cast<double>(times_ms.size() - 1));
  return times_ms[at];
}

// One cycle of a PLC: trigger, status and result in one read. Answers missed or wrong are counted.
int run_cycles(RawClient& plc, std::vector<double>& times_ms) {
  int wrong = 0;
  for (int cycle = 1; cycle <= kCycles; ++cycle) {
    const std::uint8_t high = HandDrivenServer::hi(static_cast<std::uint16_t>(cycle));
    const std::uint8_t low = HandDrivenServer::lo(static_cast<std::uint16_t>(cycle));
    for (const Bytes& request :
         {make_adu(1, 1, {16, 0, 0, 0, 2, 4, high, low, 0, 20}), kStatusRead}) {
      const Time::time_point sent = Time::now();
      if (plc.send(request) != request.size()) return wrong + 1;
      const Bytes answer = plc.wait_answer(5000);
      times_ms.push_back(std::chrono::duration<double, std::milli>(Time::now() - sent).count());
      const bool read = request[7] == 4;
      const bool right = read ? answer.size() == 169 && answer[17] == high && answer[18] == low
                              : answer.size() == 12 && answer[7] == 16;
      wrong += right ? 0 : 1;
    }
    pause_ms(1);
  }
  return wrong;
}

TEST(ModbusHostileNetwork, TheControllingClientLosesNothing) {
  ScriptedDevice device;
  device.commands.reserve(kCycles + 1);
  device.result.objects.push_back(accepted_object());
  ServerThread thread(test_config(), device);
  const std::uint16_t port = thread.port();
  RawClient plc(port);
  std::vector<RawClient> idle;
  int refused = 0;
  std::atomic<bool> stop{false};
  std::atomic<int> connections{0};
  std::vector<std::thread> crowd;
  crowd.push_back(nuisance(port, "127.0.0.2", stop, connections, dribble));
  crowd.push_back(nuisance(port, "127.0.0.2", stop, connections, send_garbage));
  crowd.push_back(nuisance(port, "127.0.0.3", stop, connections, never_read));
  crowd.push_back(nuisance(port, "127.0.0.9", stop, connections, send_garbage));
  for (int i = 0; i < kIdleClients; ++i) idle.emplace_back(port, "127.0.0.2");
  pause_ms(50);
  for (RawClient& client : idle) {
    client.receive();
    refused += client.closed_by_server() ? 1 : 0;
  }
  // Room for the nuisances, which try all the time.
  for (int i = 0, closed = 0; closed < kNuisancePlaces; ++i) {
    if (idle[static_cast<std::size_t>(i)].closed_by_server()) continue;
    idle[static_cast<std::size_t>(i)].close();
    ++closed;
  }
  std::vector<double> times_ms;
  const int wrong = run_cycles(plc, times_ms);
  stop = true;
  for (std::thread& nuisance_thread : crowd) nuisance_thread.join();
  thread.stop();
  const FieldBusCounters& counters = thread.server().counters();
  std::printf(
      "controlling client: %zu answers, p50 %.3f ms, p99 %.3f ms, max %.3f ms; %d connections of "
      "nuisances, %u refused, %u bytes discarded, %u requests served\n",
      times_ms.size(), percentile_ms(times_ms, 0.5), percentile_ms(times_ms, 0.99),
      percentile_ms(times_ms, 1.0), connections.load(), counters.connections_refused,
      counters.bytes_discarded, counters.requests);
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(device.commands.size(), static_cast<std::size_t>(kCycles));
  EXPECT_EQ(device.control_losses, 0);
  EXPECT_GE(refused, kIdleClients - 15);
  EXPECT_GT(counters.bytes_discarded, 10'000u) << "the garbage was not let in";
  EXPECT_GT(counters.requests, 2u * kCycles + 100u) << "the client that never reads was not let in";
}

}  // namespace
}  // namespace grapnel::test
