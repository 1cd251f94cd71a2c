// Who is let in, and who is shown out.
#include <gtest/gtest.h>

#include <sys/socket.h>
#include <unistd.h>

#include <vector>

#include "tests/drivers/modbus/support/hand_driven_server.h"

namespace grapnel::test {
namespace {

const Bytes kReadProbe = {4, 0x03, 0x84, 0, 2};

bool is_closed(HandDrivenServer& server, RawClient& client) {
  for (int i = 0; i < 20 && !client.closed_by_server(); ++i) {
    server.server.poll_once(1);
    client.receive();
  }
  return client.closed_by_server();
}

bool is_served(HandDrivenServer& server, RawClient& client) {
  return server.ask_pdu(client, kReadProbe).size() == 6;
}

TEST(ModbusConnections, UnknownAddressesAreRefusedAtOnce) {
  HandDrivenServer server;
  RawClient stranger = server.connect("127.0.0.9");
  EXPECT_TRUE(is_closed(server, stranger));
  EXPECT_EQ(server.server.counters().connections_refused, 1u);
}

TEST(ModbusConnections, TheLongestMatchingNetworkDecides) {
  ModbusConfig config = test_config();
  config.control_peers = {"127.0.0.0/8", "127.0.1.7"};
  config.read_peers = {"127.0.1.0/24"};
  HandDrivenServer server(config);
  RawClient control = server.connect("127.0.1.7");
  RawClient reader = server.connect("127.0.1.8");
  EXPECT_EQ(server.write(reader, 0, {1, 20}), (Bytes{0x90, 1}));
  EXPECT_EQ(server.write(control, 0, {1, 20}), (Bytes{16, 0, 0, 0, 2}));
}

TEST(ModbusConnections, BadEntriesOfTheAllowListAreNamed) {
  for (const char* entry : {"127.0.0", "localhost", "10.0.0.1/8", "10.0.0.0/33", "10.0.0.0/", ""}) {
    ModbusConfig config = test_config();
    config.read_peers = {entry};
    ScriptedDevice device;
    const MonotonicClock clock;
    ModbusServer server(config, device, clock);
    const Status opened = server.open();
    ASSERT_FALSE(opened.ok()) << entry;
    EXPECT_EQ(opened.error().code, Code::BadParameter);
    EXPECT_NE(server.problem().find("read_peers"), std::string::npos) << server.problem();
  }
}

TEST(ModbusConnections, APortInUseIsAProblemInOneLine) {
  HandDrivenServer first;
  ModbusConfig config = test_config();
  config.port = first.server.port();
  ScriptedDevice device;
  ModbusServer second(config, device, first.clock);
  EXPECT_FALSE(second.open().ok());
  EXPECT_NE(second.problem().find("in use"), std::string::npos) << second.problem();
}

TEST(ModbusConnections, BeyondTheTableReadersAreRefusedAndTheControlPlaceStaysFree) {
  HandDrivenServer server;
  std::vector<RawClient> idle;
  for (int i = 0; i < 50; ++i) idle.push_back(server.connect("127.0.0.2"));
  int closed = 0;
  for (RawClient& client : idle) {
    client.receive();
    closed += client.closed_by_server() ? 1 : 0;
  }
  EXPECT_EQ(closed, 35);
  EXPECT_EQ(server.server.counters().clients, 15u);
  RawClient plc = server.connect();
  EXPECT_EQ(server.write(plc, 0, {1, 20}), (Bytes{16, 0, 0, 0, 2}));
  EXPECT_EQ(server.server.counters().clients, 16u);
  RawClient late = server.connect();
  EXPECT_TRUE(is_closed(server, late)) << "the table is full";
}

TEST(ModbusConnections, SilentControlPeersCannotHoldTheControlPlace) {
  HandDrivenServer server;
  std::vector<RawClient> idle;
  for (int i = 0; i < 50; ++i) idle.push_back(server.connect());
  RawClient plc = server.connect();
  EXPECT_TRUE(is_served(server, plc));
  EXPECT_EQ(server.write(plc, 0, {1, 20}), (Bytes{16, 0, 0, 0, 2}));
  server.clock.advance_us(5'000'000);
  EXPECT_TRUE(is_served(server, plc)) << "the owner keeps its place";
}

TEST(ModbusConnections, TheControlPlaceHasToBeUsedWithinASecond) {
  HandDrivenServer server;
  std::vector<RawClient> idle;
  for (int i = 0; i < 15; ++i) idle.push_back(server.connect());
  RawClient reader_in_control_place = server.connect();
  EXPECT_TRUE(is_served(server, reader_in_control_place));
  server.clock.advance_us(1'100'000);
  EXPECT_TRUE(is_closed(server, reader_in_control_place));
  RawClient another = server.connect();
  idle.pop_back();
  server.turn();
  server.clock.advance_us(1'100'000);
  EXPECT_TRUE(is_served(server, another)) << "a regular place became free";
}

TEST(ModbusConnections, TheOwnerOfAFullTableIsReplacedAfterItsHeartbeatDied) {
  HandDrivenServer server;
  std::vector<RawClient> idle;
  RawClient plc = server.connect();
  server.write(plc, 26, {1, 500});
  for (int i = 0; i < 15; ++i) idle.push_back(server.connect("127.0.0.2"));
  EXPECT_EQ(server.server.counters().clients, 16u);
  server.clock.advance_us(600'000);
  server.turn();
  server.clock.advance_us(1'100'000);
  EXPECT_TRUE(is_closed(server, plc));
  RawClient next = server.connect();
  EXPECT_EQ(server.write(next, 0, {1, 10}), (Bytes{16, 0, 0, 0, 2}));
}

TEST(ModbusConnections, AClosedClientLeavesItsPlace) {
  HandDrivenServer server;
  for (int i = 0; i < 100; ++i) {
    RawClient client = server.connect();
    ASSERT_TRUE(is_served(server, client)) << i;
    client.close();
    server.turn();
  }
  EXPECT_EQ(server.server.counters().clients, 0u);
}

TEST(ModbusConnections, ADribblingRequestIsCutOffAfterOneSecond) {
  HandDrivenServer server;
  RawClient client = server.connect();
  const Bytes adu = make_adu(1, 1, kReadProbe);
  for (std::size_t i = 0; i + 1 < adu.size(); ++i) {
    client.send({adu[i]});
    server.turn();
    server.clock.advance_us(99'000);
    client.receive();
    ASSERT_FALSE(client.closed_by_server()) << i;
    if (i == 9) break;
  }
  server.clock.advance_us(20'000);
  EXPECT_TRUE(is_closed(server, client));
  EXPECT_EQ(server.server.counters().bytes_discarded, 10u);
}

TEST(ModbusConnections, ADeadlineStartsWithEachRequest) {
  HandDrivenServer server;
  RawClient client = server.connect();
  const Bytes adu = make_adu(1, 1, kReadProbe);
  const Bytes head(adu.begin(), adu.begin() + 5);
  const Bytes tail(adu.begin() + 5, adu.end());
  for (int i = 0; i < 5; ++i) {
    client.send(head);
    server.turn();
    server.clock.advance_us(900'000);
    EXPECT_EQ(server.ask(client, tail).size(), 13u) << i;
  }
}

TEST(ModbusConnections, ReadPeersAreDroppedAfterAMinuteOfSilenceAndControlPeersNever) {
  HandDrivenServer server;
  RawClient reader = server.connect("127.0.0.2");
  RawClient control = server.connect();
  server.clock.advance_us(59'000'000);
  EXPECT_TRUE(is_served(server, reader));
  server.clock.advance_us(59'000'000);
  EXPECT_TRUE(is_served(server, reader));
  server.clock.advance_us(61'000'000);
  EXPECT_TRUE(is_closed(server, reader));
  server.clock.advance_us(86'400'000'000);
  EXPECT_TRUE(is_served(server, control));
}

// Sends requests and never reads, until the server's buffers for it are full.
void stuff(HandDrivenServer& server, RawClient& client) {
  const Bytes request = make_adu(1, 1, {4, 0, 100, 0, 125});
  std::size_t offset = 0;  // within the request, when the socket took only a part
  for (int idle_rounds = 0; idle_rounds < 20;) {
    const Bytes rest(request.begin() + static_cast<std::ptrdiff_t>(offset), request.end());
    const std::size_t sent = client.send(rest);
    offset = (offset + sent) % request.size();
    idle_rounds = sent == 0 ? idle_rounds + 1 : 0;
    server.turn(1);
  }
}

TEST(ModbusConnections, AClientThatNeverReadsIsDroppedAfter200Milliseconds) {
  HandDrivenServer server;
  RawClient good = server.connect();
  RawClient deaf(server.server.port(), "127.0.0.1", 2048);
  server.turn();
  stuff(server, deaf);
  EXPECT_EQ(server.server.counters().clients, 2u);
  EXPECT_TRUE(is_served(server, good)) << "nobody waits for it";
  server.clock.advance_us(210'000);
  server.turn();
  EXPECT_EQ(server.server.counters().clients, 1u);
  EXPECT_TRUE(is_served(server, good));
}

TEST(ModbusConnections, AClientThatReadsLateLosesNothing) {
  HandDrivenServer server;
  RawClient client(server.server.port(), "127.0.0.1", 4096);
  server.turn();
  constexpr int kRequests = 300;
  Bytes stream;
  for (std::uint16_t i = 0; i < kRequests; ++i) {
    stream = stream + make_adu(i, 1, {4, 0, 100, 0, 125});
  }
  std::size_t sent = 0;
  int answers = 0;
  for (int round = 0; round < 20'000 && answers < kRequests; ++round) {
    if (sent < stream.size()) {
      sent += client.send(Bytes(stream.begin() + static_cast<std::ptrdiff_t>(sent), stream.end()));
    }
    server.turn(1);
    if (round % 7 != 0) continue;
    for (Bytes answer = client.take_answer(); !answer.empty(); answer = client.take_answer()) {
      ASSERT_EQ(answer[0] << 8 | answer[1], answers);
      ++answers;
    }
  }
  EXPECT_EQ(answers, kRequests);
}

TEST(ModbusConnections, AResetIsNoHarm) {
  HandDrivenServer server;
  for (int i = 0; i < 20; ++i) {
    RawClient client = server.connect();
    client.send(make_adu(1, 1, kReadProbe));
    const linger now{1, 0};
    setsockopt(client.socket(), SOL_SOCKET, SO_LINGER, &now, sizeof now);
    client.close();
    server.turn();
  }
  RawClient good = server.connect();
  EXPECT_TRUE(is_served(server, good));
  EXPECT_EQ(server.server.counters().clients, 1u);
}

TEST(ModbusConnections, AnInheritedListenerIsServed) {
  ModbusConfig config = test_config();
  ModbusOptions options;
  options.inherited_listener = ::socket(AF_INET, SOCK_STREAM, 0);
  ASSERT_EQ(listen(options.inherited_listener, 4), 0);
  config.listen_address = "";
  HandDrivenServer server(config, options);
  EXPECT_NE(server.server.port(), 0);
  RawClient client = server.connect();
  EXPECT_TRUE(is_served(server, client));
}

TEST(ModbusConnections, AnInheritedDescriptorThatDoesNotListenIsRefused) {
  ModbusOptions options;
  options.inherited_listener = ::socket(AF_INET, SOCK_STREAM, 0);
  ScriptedDevice device;
  const MonotonicClock clock;
  ModbusServer server(test_config(), device, clock, options);
  EXPECT_FALSE(server.open().ok());
  EXPECT_NE(server.problem().find("not a listening socket"), std::string::npos);
  close(options.inherited_listener);
}

TEST(ModbusConnections, ProgressIsReportedEveryRound) {
  int rounds = 0;
  ModbusOptions options;
  options.hooks.context = &rounds;
  options.hooks.progress = [](void* context) noexcept { ++*static_cast<int*>(context); };
  HandDrivenServer server(test_config(), options);
  server.turn(5);
  EXPECT_EQ(rounds, 5);
}

TEST(ModbusConnections, RefusalsAreLoggedAtMostOnceASecond) {
  const MonotonicClock clock;
  LogRing log(clock);
  ModbusOptions options;
  options.log = &log;
  HandDrivenServer server(test_config(), options);
  for (int i = 0; i < 10; ++i) static_cast<void>(server.connect("127.0.0.9"));
  server.clock.advance_us(1'000'001);
  static_cast<void>(server.connect("127.0.0.9"));
  LogEvent event;
  int events = 0;
  while (log.pop(event)) ++events;
  EXPECT_EQ(events, 2);
  EXPECT_EQ(event.numbers[0], 0x7f000009);
  EXPECT_EQ(event.numbers[1], 11);
}

}  // namespace
}  // namespace grapnel::test
