#include "drivers/modbus/modbus_server.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <span>

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "drivers/modbus/request_handler.h"
#include "drivers/modbus/rtu_link.h"
#include "drivers/modbus/tcp_server.h"

namespace grapnel {
namespace {

constexpr std::int64_t kLongestWaitUs = 50'000;
constexpr std::size_t kWakeEntry = 0;
constexpr std::size_t kRtuEntry = 1;
constexpr std::size_t kTcpEntries = 2;

}  // namespace

struct ModbusServer::Parts {
  Parts(const ModbusConfig& config, const ModbusOptions& options, PlcCommandSink& sink)
      : handler(config, options.identity, sink),
        tcp(config, handler, options.log),
        rtu(config, handler) {}
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;
  ~Parts() {
    if (wake >= 0) close(wake);
  }

  RequestHandler handler;
  TcpServer tcp;
  RtuLink rtu;
  std::vector<pollfd> entries;
  int wake = -1;
  bool open = false;
};

ModbusServer::ModbusServer(const ModbusConfig& config, PlcCommandSink& sink, const Clock& clock,
                           ModbusOptions options)
    : config_(config),
      sink_(&sink),
      clock_(&clock),
      options_(std::move(options)),
      parts_(std::make_unique<Parts>(config_, options_, sink)) {}

ModbusServer::~ModbusServer() = default;

Status ModbusServer::open() {
  if (parts_->open) return {};
  problem_.clear();
  parts_ = std::make_unique<Parts>(config_, options_, *sink_);
  const Status handler = parts_->handler.open(clock_->now_us());
  parts_->wake = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (!handler || parts_->wake < 0) {
    const int reason = handler ? errno : handler.error().detail;
    problem_ = "modbus: can't start: " + std::string(std::strerror(reason));
    return Error{Code::InternalFault, Stage::FieldBus, reason};
  }
  const bool tcp = !config_.listen_address.empty() || options_.inherited_listener >= 0;
  const bool opened = (!tcp || parts_->tcp.open(options_.inherited_listener, problem_)) &&
                      parts_->rtu.open(problem_);
  if (!opened) return Error{Code::BadParameter, Stage::FieldBus, 0};
  parts_->entries.resize(kTcpEntries + parts_->tcp.poll_count());
  parts_->open = true;
  return {};
}

std::uint16_t ModbusServer::port() const noexcept { return parts_->tcp.port(); }

const FieldBusCounters& ModbusServer::counters() const noexcept {
  return parts_->handler.counters();
}

void ModbusServer::run(const std::atomic<bool>& stop) noexcept {
  const FieldBusHooks& hooks = options_.hooks;
  if (hooks.thread_started != nullptr) hooks.thread_started(hooks.context);
  while (!stop.load(std::memory_order_acquire)) {
    poll_once(static_cast<int>(kLongestWaitUs / 1000));
  }
}

void ModbusServer::poll_once(int timeout_ms) noexcept {
  GRAPNEL_ASSERT(parts_->open);
  Parts& parts = *parts_;
  const std::span<pollfd> entries(parts.entries);
  std::int64_t now_us = clock_->now_us();
  entries[kWakeEntry] = {parts.wake, POLLIN, 0};
  entries[kRtuEntry] = parts.rtu.poll_entry();
  parts.tcp.fill_poll(entries.subspan(kTcpEntries), now_us);
  const std::int64_t deadline_us =
      std::min({parts.tcp.deadline_us(), parts.rtu.deadline_us(),
                parts.handler.command_block().heartbeat_deadline_us()});
  std::int64_t wait_us = std::min<std::int64_t>(timeout_ms * std::int64_t{1000}, kLongestWaitUs);
  if (deadline_us != TcpConnection::kNever) {
    wait_us = std::clamp<std::int64_t>(deadline_us - now_us, 0, wait_us);
  }
  const timespec wait{0, wait_us * 1000};
  const int ready = ppoll(entries.data(), entries.size(), &wait, nullptr);
  if (ready <= 0) {
    for (pollfd& entry : entries) entry.revents = 0;
  }
  if (entries[kWakeEntry].revents != 0) {
    std::uint64_t count = 0;
    if (read(parts.wake, &count, sizeof count) < 0) entries[kWakeEntry].revents = 0;
  }
  now_us = clock_->now_us();
  parts.handler.command_block().supervise(now_us);
  parts.handler.refresh(now_us);
  parts.rtu.serve(entries[kRtuEntry].revents, now_us);
  parts.tcp.serve(entries.subspan(kTcpEntries), now_us);
  if (options_.hooks.progress != nullptr) options_.hooks.progress(options_.hooks.context);
}

void ModbusServer::wake() noexcept {
  const std::uint64_t one = 1;
  // A full counter wakes as well.
  [[maybe_unused]] const ssize_t written = write(parts_->wake, &one, sizeof one);
}

}  // namespace grapnel
