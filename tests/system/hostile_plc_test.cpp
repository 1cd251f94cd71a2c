#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <sys/stat.h>

#include "tests/system/daemon_process.h"

namespace grapnel::test {
namespace {

namespace fs = std::filesystem;

constexpr int kJobs = 4;

std::uint16_t word(PlcCommandCode code) { return static_cast<std::uint16_t>(code); }

TEST(HostilePlc, AnAbortAtAnyMomentEndsTheJobAndLeavesTheNextOneWhole) {
  const Site site;
  DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  Plc plc(daemon.port());
  // From the wait for a frame (67 ms apart) into the registration and past its end.
  for (int wait_ms = 0; wait_ms <= 150; wait_ms += 10) {
    PlcCommand command{.code = word(PlcCommandCode::Register), .timeout_ms = 10'000};
    ASSERT_TRUE(plc.client().send(command));
    std::this_thread::sleep_for(std::chrono::milliseconds(wait_ms));
    const PlcReading before = plc.read();
    EXPECT_EQ(plc.send(PlcCommandCode::Abort, {}, false).ack_code, Code::Accepted);
    const PlcReading after = plc.read();
    EXPECT_EQ(after.status.flags & kFlagBusy, 0);
    EXPECT_EQ(after.status.flags & kFlagResultValid, 0);
    const bool was_busy = (before.status.flags & kFlagBusy) != 0;
    if (was_busy && after.result_no != 0) {
      EXPECT_EQ(after.result.code, Code::Aborted);
      EXPECT_EQ(after.result.cmd_seq, command.seq);
    }
    // A job that winds down may make the next one wait its turn, no more.
    ASSERT_TRUE(eventually([&] {
      const PlcAnswer next = plc.send(PlcCommandCode::Register, {.timeout_ms = 10'000});
      if (next.ack_code == Code::Busy) return false;
      EXPECT_EQ(next.reading.result.code, Code::ObjectFound);
      return true;
    }));
  }
}

TEST(HostilePlc, ATokenThatCameBeforeRunsNothingEvenOverAReconnect) {
  const Site site;
  DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  std::uint16_t words[2] = {5, word(PlcCommandCode::Register)};
  {
    Plc plc(daemon.port());
    ASSERT_TRUE(plc.client().write(0, 2, words));
    ASSERT_TRUE(eventually([&] { return (plc.status().flags & kFlagDone) != 0; }));
  }
  Plc plc(daemon.port());
  const std::uint16_t number = plc.read().result_no;
  for (int i = 0; i < 5; ++i) ASSERT_TRUE(plc.client().write(0, 2, words));
  EXPECT_EQ(plc.diagnostic(kJobs), 1U);
  EXPECT_EQ(plc.read().result_no, number);
  // Taken back and given again it is a new one.
  words[0] = 0;
  ASSERT_TRUE(plc.client().write(0, 2, words));
  EXPECT_EQ(plc.status().ack_seq, 0);
  words[0] = 5;
  ASSERT_TRUE(plc.client().write(0, 2, words));
  EXPECT_EQ(plc.diagnostic(kJobs), 2U);
}

TEST(HostilePlc, ARestartLeavesNothingToTheBitsThatThePlcStillHolds) {
  const Site site;
  const std::uint16_t held[2] = {7, word(PlcCommandCode::Register)};
  {
    DaemonProcess daemon(site);
    ASSERT_TRUE(daemon.wait_ready());
    Plc plc(daemon.port());
    ASSERT_TRUE(plc.client().write(0, 2, held));
    daemon.signal(SIGKILL);
    EXPECT_EQ(daemon.wait_end(), -SIGKILL);
  }
  DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  Plc plc(daemon.port());
  // Waiting for token 7, the PLC sees neither its acknowledgement nor an answer.
  const PlcReading reading = plc.read();
  EXPECT_EQ(reading.status.ack_seq, 0);
  EXPECT_EQ(reading.result.cmd_seq, 0);
  EXPECT_EQ(reading.status.flags & (kFlagDone | kFlagBusy | kFlagResultValid), 0);
  const std::uint16_t none[2] = {0, 0};
  ASSERT_TRUE(plc.client().write(0, 2, none));
  EXPECT_EQ(plc.diagnostic(kJobs), 0U);
}

TEST(HostilePlc, SingleWordsOfALatchedResultAreThoseOfTheBlock) {
  const Site site;
  DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  Plc plc(daemon.port());
  ASSERT_EQ(plc.send(PlcCommandCode::Register, {.timeout_ms = 10'000}).reading.result.code,
            Code::ObjectFound);
  std::vector<std::uint16_t> block(60);
  ASSERT_TRUE(plc.client().read_input(120, 60, block.data()));
  for (std::uint16_t i = 0; i < 60; ++i) {
    std::uint16_t input = 0;
    std::uint16_t holding = 0;
    ASSERT_TRUE(plc.client().read_input(static_cast<std::uint16_t>(120 + i), 1, &input));
    ASSERT_TRUE(plc.client().read_holding(static_cast<std::uint16_t>(120 + i), 1, &holding));
    EXPECT_EQ(input, block[i]) << 120 + i;
    EXPECT_EQ(holding, block[i]) << 120 + i;
  }
}

TEST(HostileTechnician, AFileCutReplacedOrGoneLeavesTheLineRunning) {
  const Site site;
  DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  Plc plc(daemon.port());
  const std::string whole = site.read("grapnel.toml");
  constexpr int kConfigRefusals = 17;
  const auto refused_after = [&](const auto& harm) {
    const std::uint32_t before = plc.diagnostic(kConfigRefusals);
    harm();
    EXPECT_TRUE(eventually([&] { return plc.diagnostic(kConfigRefusals) > before; }));
    const PlcAnswer answer = plc.send(PlcCommandCode::Register, {.timeout_ms = 10'000});
    EXPECT_EQ(answer.reading.result.code, Code::ObjectFound);
    EXPECT_EQ(answer.reading.result.preset, 10);
    EXPECT_NE(answer.reading.status.flags & kFlagReduced, 0);
    site.write("grapnel.toml", whole);
    EXPECT_TRUE(eventually([&] { return (plc.status().flags & kFlagReduced) == 0; }));
  };
  // In the middle of a key: a file cut between two lines may be a whole one.
  for (const std::size_t bytes : {std::size_t{0}, std::size_t{5}, whole.find("width") + 2}) {
    refused_after([&] { site.write("grapnel.toml", whole.substr(0, bytes)); });
  }
  refused_after([&] { fs::remove(site.config()); });
  refused_after([&] { fs::rename(site.config(), site.folder() / "away.toml"); });
  refused_after([&] {
    fs::remove(site.config());
    ::mkfifo(site.config().c_str(), 0600);
  });
  refused_after([&] {
    fs::remove(site.config());
    fs::create_symlink("nowhere.toml", site.config());
  });
}

TEST(HostileTechnician, PresetsThatChangeDuringJobsNeverMix) {
  const Site site;
  DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  Plc plc(daemon.port());
  const std::uint16_t box = [&] {
    plc.send(PlcCommandCode::SelectPreset, {.preset_id = 11});
    return plc.status().preset_rev;
  }();
  plc.send(PlcCommandCode::SelectPreset, {.preset_id = 10});
  const std::uint16_t sack = plc.status().preset_rev;
  for (int i = 0; i < 6; ++i) {
    site.write("grapnel.toml", Site::config_text(i % 2 == 0 ? 11 : 10));
    for (int job = 0; job < 3; ++job) {
      const PlcResult result =
          plc.send(PlcCommandCode::Register, {.timeout_ms = 10'000}).reading.result;
      ASSERT_TRUE(result.preset == 10 || result.preset == 11) << result.preset;
      EXPECT_EQ(result.preset_rev, result.preset == 10 ? sack : box);
    }
    EXPECT_TRUE(eventually([&] { return plc.status().active_preset == (i % 2 == 0 ? 11 : 10); }));
  }
}

TEST(HostileCamera, GoingAwayAtAnyMomentIsAnAnswerAndNeverAPose) {
  const Site site;
  std::string faults;
  for (int i = 0; i < 20; ++i) {
    faults += "[[fault]]\nkind = \"disconnect\"\nat_frame = " + std::to_string(30 + 12 * i) +
              "\nframes = 5\n";
  }
  site.write("scene.toml", Site::scene_text(faults));
  DaemonProcess daemon(site);
  ASSERT_TRUE(daemon.wait_ready());
  Plc plc(daemon.port());
  int found = 0;
  int lost = 0;
  ASSERT_TRUE(eventually(
      [&] {
        const PlcAnswer answer = plc.send(PlcCommandCode::Register, {.timeout_ms = 2000});
        const Code code = answer.reading.result.code;
        const bool valid = (answer.reading.status.flags & kFlagResultValid) != 0;
        EXPECT_EQ(valid, code == Code::ObjectFound);
        EXPECT_EQ(answer.reading.status.flags & kFlagBusy, 0);
        EXPECT_LT(answer.latency_us, 3'000'000);
        const auto number = static_cast<int>(code);
        EXPECT_TRUE(code == Code::ObjectFound || number / 100 == 20) << number;
        (code == Code::ObjectFound ? found : lost) += 1;
        return found >= 5 && lost >= 5;
      },
      60'000));
}

TEST(HostileClock, OnlyTheJournalAndARecordingsStartAskForTheTimeOfDay) {
  const std::vector<std::string> words = {"CLOCK_REALTIME", "system_clock", "gettimeofday",
                                          "time(nullptr)", "time(NULL)"};
  const fs::path source = GRAPNEL_SOURCE_DIR;
  for (const char* folder : {"base", "hal", "drivers", "pipeline", "firmware_app"}) {
    for (const auto& entry : fs::recursive_directory_iterator(source / folder)) {
      const std::string extension = entry.path().extension().string();
      const fs::path stem = entry.path().stem();
      if ((extension != ".cpp" && extension != ".h") || stem == "journal" || stem == "wall_clock") {
        continue;
      }
      const std::string text = text_of(entry.path());
      for (const std::string& found : words) {
        EXPECT_EQ(text.find(found), std::string::npos) << entry.path() << " uses " << found;
      }
    }
  }
}

}  // namespace
}  // namespace grapnel::test
