#pragma once

#include <atomic>
#include <stdexcept>
#include <thread>

#include "base/clock.h"
#include "drivers/modbus/modbus_server.h"

namespace grapnel::test {

/// A server on a thread of its own, as the daemon runs it.
class ServerThread {
 public:
  ServerThread(const ModbusConfig& config, PlcCommandSink& sink, ModbusOptions options = {})
      : server_(config, sink, clock_, std::move(options)) {
    if (!server_.open()) throw std::runtime_error(server_.problem());
    port_ = server_.port();
    thread_ = std::thread([this] { server_.run(stop_); });
  }
  ServerThread(const ServerThread&) = delete;
  ServerThread& operator=(const ServerThread&) = delete;
  ~ServerThread() { stop(); }

  void stop() {
    if (!thread_.joinable()) return;
    stop_ = true;
    server_.wake();
    thread_.join();
  }
  [[nodiscard]] std::uint16_t port() const { return port_; }
  [[nodiscard]] ModbusServer& server() { return server_; }

 private:
  MonotonicClock clock_;
  ModbusServer server_;
  std::uint16_t port_ = 0;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace grapnel::test
