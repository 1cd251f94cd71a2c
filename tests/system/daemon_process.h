#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "drivers/modbus/plc_client.h"

namespace grapnel::test {

/// A folder with a whole configuration: one sack under a small simulated camera, the shipped
/// presets 10 to 13. Goes away with the test.
class Site {
 public:
  Site();
  Site(const Site&) = delete;
  Site& operator=(const Site&) = delete;
  ~Site();

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] std::filesystem::path config() const { return folder_ / "grapnel.toml"; }
  void write(const std::string& name, const std::string& text) const;
  [[nodiscard]] std::string read(const std::string& name) const;
  /// grapnel.toml of a working site, `extra` lines at its end.
  [[nodiscard]] static std::string config_text(int preset, const std::string& extra = "");
  /// The scene; `extra` lines at its end.
  [[nodiscard]] static std::string scene_text(const std::string& extra = "");

 private:
  std::filesystem::path folder_;
};

/// What a program that ran to its end said.
struct Finished {
  int status = -1;
  std::string out;
  std::string err;
};

/// Runs grapneld with these arguments to its end.
[[nodiscard]] Finished run_grapneld(const std::vector<std::string>& arguments);

/// A running grapneld on a free port.
class DaemonProcess {
 public:
  struct Options {
    std::vector<std::string> arguments = {};
    std::vector<std::pair<std::string, std::string>> environment = {};
    int listener = -1;  ///< handed over as systemd does
  };

  explicit DaemonProcess(const Site& site) : DaemonProcess(site, Options{}) {}
  DaemonProcess(const Site& site, const Options& options);
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;
  ~DaemonProcess();

  /// Waits until the daemon says ready. False when it ends or does not get there in time.
  [[nodiscard]] bool wait_ready();
  [[nodiscard]] int port() const { return port_; }
  [[nodiscard]] pid_t pid() const { return pid_; }
  void signal(int number) const;
  /// Waits for the end: the exit status, or minus the signal.
  int wait_end();
  [[nodiscard]] std::string log() const;
  /// True when the log has this text, waited for.
  [[nodiscard]] bool says(const std::string& text) const;

 private:
  std::filesystem::path log_file_;
  pid_t pid_ = -1;
  int port_ = 0;
};

/// A PLC that is connected to a daemon.
class Plc {
 public:
  explicit Plc(int port);

  [[nodiscard]] PlcReading read();
  [[nodiscard]] PlcStatus status() { return read().status; }
  /// Sends a command; with `wait` until its result is there.
  PlcAnswer send(PlcCommandCode code, PlcCommand command = {}, bool wait = true);
  /// Diagnostics register pair k.
  [[nodiscard]] std::uint32_t diagnostic(int k);
  [[nodiscard]] PlcClient& client() { return client_; }

 private:
  PlcClient client_;
};

/// A file's bytes; "" when it can't be read.
[[nodiscard]] std::string text_of(const std::filesystem::path& file);

/// Looks every few milliseconds until `happened` or the limit, far above what a loaded machine
/// needs.
[[nodiscard]] bool eventually(const std::function<bool()>& happened, int limit_ms = 10'000);

}  // namespace grapnel::test
