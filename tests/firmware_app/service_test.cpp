#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <fstream>
#include <string>

#include "base/assert.h"
#include "base/input_error.h"
#include "firmware_app/config_watch.h"
#include "firmware_app/crash_record.h"
#include "firmware_app/durable_file.h"
#include "firmware_app/journal.h"
#include "firmware_app/notify.h"
#include "firmware_app/options.h"
#include "firmware_app/supervisor.h"
#include "tests/firmware_app/fakes.h"

namespace grapnel {
namespace {

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

TEST(Supervisor, IsAliveOnlyWhileEveryExpectedThreadMoves) {
  Supervisor supervisor;
  EXPECT_TRUE(supervisor.alive(0));
  supervisor.expect(Supervised::Registration, true);
  supervisor.expect(Supervised::FieldBus, true);
  EXPECT_TRUE(supervisor.alive(1000));
  supervisor.progress(Supervised::FieldBus) += 1;
  EXPECT_TRUE(supervisor.alive(Supervisor::kSilenceLimitUs));
  EXPECT_FALSE(supervisor.alive(Supervisor::kSilenceLimitUs + 1000));
  EXPECT_EQ(supervisor.silent(), Supervised::Registration);
  supervisor.progress(Supervised::Registration) += 1;
  supervisor.progress(Supervised::FieldBus) += 1;
  EXPECT_TRUE(supervisor.alive(Supervisor::kSilenceLimitUs + 2000));
  supervisor.expect(Supervised::Registration, false);
  supervisor.progress(Supervised::FieldBus) += 1;
  EXPECT_TRUE(supervisor.alive(100 * Supervisor::kSilenceLimitUs));
}

TEST(ServiceNotifier, SpeaksTheServiceManagersProtocol) {
  const test::TemporaryFolder folder;
  const std::string path = (folder.path() / "notify").string();
  const int server = socket(AF_UNIX, SOCK_DGRAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  ASSERT_EQ(bind(server, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  setenv("NOTIFY_SOCKET", path.c_str(), 1);
  setenv("WATCHDOG_USEC", "3000000", 1);
  const ServiceNotifier notifier;
  unsetenv("NOTIFY_SOCKET");
  unsetenv("WATCHDOG_USEC");
  EXPECT_EQ(notifier.watchdog_interval_us(), 3'000'000);
  notifier.send("READY=1");
  char text[64] = {};
  EXPECT_EQ(recv(server, text, sizeof text, 0), 7);
  EXPECT_STREQ(text, "READY=1");
  close(server);
}

TEST(ServiceNotifier, IsSilentWithoutAServiceManager) {
  const ServiceNotifier notifier;
  EXPECT_EQ(notifier.watchdog_interval_us(), 0);
  notifier.send("READY=1");
}

TEST(Journal, WritesPriorityUnderTheJournalOnly) {
  LogEvent event;
  event.text = "job {} took {} us";
  event.numbers = {3, 250, 0};
  event.code = Code::JobDeadline;
  event.stage = Stage::Publish;
  event.level = LogLevel::Warning;
  EXPECT_EQ(event_text(event), "job 3 took 250 us (1019 job deadline) [publish]");
  std::FILE* out = std::tmpfile();
  Journal(true, out).write(event);
  Journal(false, out).write(event);
  std::rewind(out);
  char line[256] = {};
  ASSERT_NE(std::fgets(line, sizeof line, out), nullptr);
  EXPECT_STREQ(line, "<4>job 3 took 250 us (1019 job deadline) [publish]\n");
  ASSERT_NE(std::fgets(line, sizeof line, out), nullptr);
  EXPECT_NE(std::strstr(line, "Z warning: job 3"), nullptr);
  std::fclose(out);
}

TEST(Journal, CutsAFloodAndSaysSo) {
  std::FILE* out = std::tmpfile();
  Journal journal(true, out);
  for (int i = 0; i < 10'000; ++i) journal.write(LogLevel::Info, "again");
  std::rewind(out);
  int lines = 0;
  for (int c = 0; (c = std::fgetc(out)) != EOF;) lines += c == '\n' ? 1 : 0;
  std::fclose(out);
  // The loop may pass a few seconds' ends on a loaded machine.
  EXPECT_GE(lines, Journal::kMaxLinesPerSecond);
  EXPECT_LT(lines, 20 * Journal::kMaxLinesPerSecond);
}

TEST(DurableFile, GivesBackWhatWasWritten) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "state";
  EXPECT_FALSE(read_durable(file).has_value());
  write_durable(file, bytes_of("first"));
  write_durable(file, bytes_of("second, longer"));
  const auto content = read_durable(file);
  ASSERT_TRUE(content.has_value());
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(content->data()), content->size()),
            "second, longer");
  EXPECT_FALSE(std::filesystem::exists(file.string() + ".new"));
}

TEST(DurableFile, RefusesEveryCut) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "state";
  write_durable(file, bytes_of("0123456789"));
  for (std::uintmax_t bytes = std::filesystem::file_size(file); bytes-- > 0;) {
    std::filesystem::resize_file(file, bytes);
    EXPECT_THROW((void)read_durable(file), InputError) << bytes;
  }
}

TEST(DurableFile, AHalfWrittenNewFileLeavesTheOldOne) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "state";
  write_durable(file, bytes_of("old"));
  folder.write("state.new", "ha");  // the power went before the rename
  EXPECT_EQ(read_durable(file)->size(), 3U);
  write_durable(file, bytes_of("new!"));
  EXPECT_EQ(read_durable(file)->size(), 4U);
}

TEST(DurableFile, SaysInOneLineWhyItCouldNotWrite) {
  try {
    write_durable("/nowhere/at/all", bytes_of("x"));
    FAIL();
  } catch (const InputError& problem) {
    EXPECT_STREQ(problem.what(),
                 "/nowhere/at/all.new: can't be created: No such file or directory");
  }
}

TEST(ConfigWatch, SeesWritesAndRenamesAndSettles) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.write("grapnel.toml", "a");
  ConfigWatch watch;
  ASSERT_TRUE(watch.watch_file(file));
  EXPECT_FALSE(watch.changed(0));
  folder.write("other.toml", "x");
  EXPECT_FALSE(watch.changed(1'000'000));
  EXPECT_FALSE(watch.changed(2'000'000));
  folder.write("grapnel.toml", "b");
  EXPECT_FALSE(watch.changed(3'000'000));
  EXPECT_TRUE(watch.changed(3'000'000 + ConfigWatch::kSettleUs));
  EXPECT_FALSE(watch.changed(4'000'000));
  folder.write("draft", "c");
  std::filesystem::rename(folder.path() / "draft", file);
  EXPECT_FALSE(watch.changed(5'000'000));
  EXPECT_TRUE(watch.changed(6'000'000));
}

TEST(ConfigWatch, SeesEveryPresetOfAFolder) {
  const test::TemporaryFolder folder;
  ConfigWatch watch;
  ASSERT_TRUE(watch.watch_folder(folder.path()));
  folder.write("11-box.txt", "x");
  (void)watch.changed(0);
  EXPECT_FALSE(watch.changed(1'000'000));
  folder.write("11-box.toml", "x");
  (void)watch.changed(2'000'000);
  EXPECT_TRUE(watch.changed(3'000'000));
}

/// Runs `body` in a process of its own, whose end is expected to be the signal.
template <class Body>
void expect_death_by(int signal, const Body& body) {
  const pid_t child = fork();
  if (child == 0) {
    std::fclose(stderr);
    body();
    _exit(0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), signal);
}

CrashRecord record_of(const std::filesystem::path& file) {
  CrashReporter reporter;
  const auto record = reporter.open(file, 1);
  return record ? *record : CrashRecord{};
}

TEST(CrashRecord, AFatalSignalLeavesItsStory) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "crash.bin";
  expect_death_by(SIGFPE, [&] {
    CrashReporter reporter;
    (void)reporter.open(file, 0xb111d);
    reporter.install();
    reporter.set_command_token(321);
    reporter.job_stage().store(Stage::Refine);
    for (int i = 0; i < 100; ++i) {
      LogEvent event;
      event.text = "event {}";
      event.numbers[0] = i;
      reporter.history().add(event);
    }
    std::raise(SIGFPE);
  });
  const CrashRecord record = record_of(file);
  EXPECT_EQ(record.kind, CrashKind::Signal);
  EXPECT_EQ(record.signal, SIGFPE);
  EXPECT_EQ(record.build_id, 0xb111dU);
  EXPECT_EQ(record.command_token, 321U);
  ASSERT_EQ(record.events, 64U);
  EXPECT_EQ(record.list[0].numbers[0], 36);
  EXPECT_EQ(record.list[63].numbers[0], 99);
  const std::string text = crash_text(record);
  EXPECT_NE(text.find("signal 8"), std::string::npos);
  EXPECT_NE(text.find("event 99"), std::string::npos);
  EXPECT_NE(text.find("job at stage refine"), std::string::npos);
  EXPECT_EQ(record_of(file).kind, CrashKind::None);  // told once
}

TEST(CrashRecord, AFailedAssertionNamesItself) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "crash.bin";
  expect_death_by(SIGABRT, [&] {
    CrashReporter reporter;
    (void)reporter.open(file, 1);
    reporter.install();
    GRAPNEL_ASSERT(1 + 1 == 3);
  });
  const CrashRecord record = record_of(file);
  EXPECT_EQ(record.kind, CrashKind::Assertion);
  EXPECT_NE(std::string(record.what.data()).find("1 + 1 == 3"), std::string::npos);
  EXPECT_NE(crash_text(record).find("no job running"), std::string::npos);
}

TEST(CrashRecord, AnAbortFromOutsideOnAStalledRunIsTheWatchdog) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "crash.bin";
  expect_death_by(SIGABRT, [&] {
    CrashReporter reporter;
    (void)reporter.open(file, 1);
    reporter.install();
    reporter.set_stalled(true);
    kill(getpid(), SIGABRT);
    pause();
  });
  EXPECT_EQ(record_of(file).kind, CrashKind::Watchdog);
}

TEST(CrashRecord, GarbageInTheFileIsNoCrash) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder.write("crash.bin", std::string(50'000, 'x'));
  EXPECT_EQ(record_of(file).kind, CrashKind::None);
}

DaemonOptions parse(const std::vector<std::string>& arguments) {
  return parse_daemon_options(arguments);
}

TEST(DaemonOptions, AreTakenInBothSpellings) {
  const DaemonOptions options =
      parse({"--config=a.toml", "--check", "--simd", "SSE4", "--set", "fieldbus.port=0"});
  EXPECT_EQ(options.config, "a.toml");
  EXPECT_EQ(options.task, DaemonOptions::Task::Check);
  EXPECT_EQ(options.simd, "SSE4");
  EXPECT_EQ(options.overrides, std::vector<std::string>{"fieldbus.port=0"});
}

TEST(DaemonOptions, RefuseWrongUsage) {
  EXPECT_THROW(parse({"--config"}), InputError);
  EXPECT_THROW(parse({"grapnel.toml"}), InputError);
  try {
    parse({"--confg", "x"});
    FAIL();
  } catch (const InputError& problem) {
    EXPECT_STREQ(problem.what(), "--confg: unknown option; did you mean --config?");
  }
}

}  // namespace
}  // namespace grapnel
