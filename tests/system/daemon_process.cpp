#include "tests/system/daemon_process.h"
#include "tests/support/sanitized.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <thread>

namespace grapnel::test {
namespace {

namespace fs = std::filesystem;

const std::string kProgram = std::string(GRAPNEL_BINARY_DIR) + "/bin/grapneld";

std::vector<char*> pointers(std::vector<std::string>& arguments) {
  std::vector<char*> list;
  for (std::string& argument : arguments) list.push_back(argument.data());
  list.push_back(nullptr);
  return list;
}

void redirect(const fs::path& file, int descriptor) {
  const int fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  ::dup2(fd, descriptor);
  ::close(fd);
}

}  // namespace

std::string text_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

Site::Site() {
  std::string pattern = (fs::temp_directory_path() / "grapnel-site-XXXXXX").string();
  folder_ = ::mkdtemp(pattern.data());
  const fs::path shipped = fs::path(GRAPNEL_SOURCE_DIR) / "config";
  fs::create_directory(folder_ / "presets");
  for (const char* preset : {"10-sack.toml", "11-box.toml", "12-barrel.toml", "13-carton.toml"}) {
    fs::copy_file(shipped / "presets" / preset, folder_ / "presets" / preset);
  }
  fs::create_directory_symlink(shipped / "models", folder_ / "models");
  write("scene.toml", scene_text());
  write("grapnel.toml", config_text(10));
}

Site::~Site() {
  std::error_code error;
  fs::remove_all(folder_, error);
}

void Site::write(const std::string& name, const std::string& text) const {
  // As an editor does it: a new file moved over the old one.
  const fs::path draft = folder_ / "draft";
  std::ofstream(draft, std::ios::binary) << text;
  fs::rename(draft, folder_ / name);
}

std::string Site::read(const std::string& name) const { return text_of(folder_ / name); }

std::string Site::config_text(int preset, const std::string& extra) {
  return "active_preset = " + std::to_string(preset) + R"(
auto_arm = true
[camera]
driver = "synthetic"
scene = "scene.toml"
loop = true
[capture]
max_width = 320
max_height = 240
color = false
exposure_us = 30000
[belt]
plane = [0.0, 0.0, -1.0, 1.1]
[fieldbus]
port = 0
[memory]
budget_mb = 128
)" + extra;
}

std::string Site::scene_text(const std::string& extra) {
  return R"([scene]
name = "test"
seed = 3
frames = 100000
rate_hz = 15.0
[camera]
width = 320
height = 240
fx = 287.5
fy = 287.5
cx = 159.5
cy = 119.5
color = false
height_m = 1.1
[[part]]
name = "sack"
kind = "sack"
model = "sack"
x_m = 0.05
y_m = 0.02
yaw_rad = 0.3
)" + extra;
}

Finished run_grapneld(const std::vector<std::string>& arguments) {
  std::string pattern = (fs::temp_directory_path() / "grapnel-run-XXXXXX").string();
  const fs::path folder = ::mkdtemp(pattern.data());
  std::vector<std::string> all = {kProgram};
  all.insert(all.end(), arguments.begin(), arguments.end());
  const std::vector<char*> list = pointers(all);
  const pid_t pid = ::fork();
  if (pid == 0) {
    redirect(folder / "out", 1);
    redirect(folder / "err", 2);
    ::execv(kProgram.c_str(), list.data());
    ::_exit(127);
  }
  Finished finished;
  int status = 0;
  ::waitpid(pid, &status, 0);
  finished.status = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  finished.out = text_of(folder / "out");
  finished.err = text_of(folder / "err");
  fs::remove_all(folder);
  return finished;
}

DaemonProcess::DaemonProcess(const Site& site, const Options& options)
    : log_file_(site.folder() / "log") {
  std::error_code error;
  fs::remove(log_file_, error);
  std::vector<std::string> arguments = {kProgram, "--config", site.config().string()};
  arguments.insert(arguments.end(), options.arguments.begin(), options.arguments.end());
  const std::vector<char*> list = pointers(arguments);
  pid_ = ::fork();
  if (pid_ != 0) return;
  redirect(log_file_, 2);
  for (const auto& [name, value] : options.environment) ::setenv(name.c_str(), value.c_str(), 1);
  if (options.listener >= 0) {
    constexpr int kFirstHandedOver = 3;
    if (options.listener != kFirstHandedOver) ::dup2(options.listener, kFirstHandedOver);
    ::fcntl(kFirstHandedOver, F_SETFD, 0);
    ::setenv("LISTEN_FDS", "1", 1);
    ::setenv("LISTEN_PID", std::to_string(::getpid()).c_str(), 1);
  }
  ::execv(kProgram.c_str(), list.data());
  ::_exit(127);
}

DaemonProcess::~DaemonProcess() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

std::string DaemonProcess::log() const { return text_of(log_file_); }

bool DaemonProcess::says(const std::string& text) const {
  return eventually([&] { return log().find(text) != std::string::npos; });
}

bool DaemonProcess::wait_ready() {
  static const std::string kReady = "ready, Modbus port ";
  const bool ready = eventually(
      [&] {
        const std::string text = log();
        const std::size_t at = text.find(kReady);
        if (at == std::string::npos) return ::waitpid(pid_, nullptr, WNOHANG) == pid_;
        port_ = std::atoi(text.c_str() + at + kReady.size());
        return true;
      },
      30'000);
  if (port_ == 0) ADD_FAILURE() << "not ready: " << log();
  return ready && port_ != 0;
}

void DaemonProcess::signal(int number) const { ::kill(pid_, number); }

int DaemonProcess::wait_end() {
  int status = 0;
  ::waitpid(pid_, &status, 0);
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

Plc::Plc(int port)
    : client_([port] {
        PlcClientOptions options;
        options.port = port;
        return options;
      }()) {
  if (!client_.connect()) ADD_FAILURE() << client_.problem();
}

PlcReading Plc::read() {
  PlcReading reading;
  if (!client_.read(reading)) ADD_FAILURE() << client_.problem();
  return reading;
}

PlcAnswer Plc::send(PlcCommandCode code, PlcCommand command, bool wait) {
  command.code = static_cast<std::uint16_t>(code);
  constexpr int kLimitMs = kSanitized ? 100'000 : 20'000;
  const Result<PlcAnswer> answer = client_.run(command, kLimitMs, wait);
  if (!answer) {
    ADD_FAILURE() << client_.problem();
    return {};
  }
  return answer.value();
}

std::uint32_t Plc::diagnostic(int k) {
  std::uint16_t words[2] = {};
  if (!client_.read_input(static_cast<std::uint16_t>(600 + 2 * k), 2, words)) {
    ADD_FAILURE() << client_.problem();
  }
  return static_cast<std::uint32_t>(words[0]) << 16 | words[1];
}

bool eventually(const std::function<bool()>& happened, int limit_ms) {
  constexpr int kSlower = kSanitized ? 6 : 1;
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(kSlower * limit_ms);
  while (!happened()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return true;
}

}  // namespace grapnel::test
