#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <poll.h>

#include "base/log.h"
#include "drivers/modbus/tcp_connection.h"

namespace grapnel {

/// Listener and connection table. One place of the table is kept for whoever owns the command
/// block: while nobody does, a control peer may stand in it for a moment, but it has to take the
/// block or another place within a second, and a silent one makes room for the next.
class TcpServer {
 public:
  /// `handler` must outlive it; `log` may be null.
  TcpServer(const ModbusConfig& config, RequestHandler& handler, LogRing* log);
  TcpServer(const TcpServer&) = delete;
  TcpServer& operator=(const TcpServer&) = delete;
  ~TcpServer();

  /// `inherited` ≥ 0 is a listening socket to take over. False with `problem` in one line.
  [[nodiscard]] bool open(int inherited, std::string& problem);
  [[nodiscard]] std::uint16_t port() const noexcept;

  /// Descriptors to poll: as many as poll_count(), the same order every time.
  [[nodiscard]] std::size_t poll_count() const noexcept { return places_.size() + 1; }
  void fill_poll(std::span<pollfd> entries, std::int64_t now_us) const noexcept;
  /// Accepts, serves and drops, the owner of the command block first.
  void serve(std::span<const pollfd> entries, std::int64_t now_us) noexcept;
  /// When serve() has to be called at the latest; 0 when requests wait already.
  [[nodiscard]] std::int64_t deadline_us() const noexcept;

 private:
  struct Place {
    TcpConnection connection;
    std::int64_t probation_end_us = TcpConnection::kNever;
    bool on_probation = false;
  };

  void accept_clients(std::int64_t now_us) noexcept;
  void admit(int client, PeerRole role, std::int64_t now_us) noexcept;
  void refuse(int client, std::uint32_t ipv4, std::int64_t now_us) noexcept;
  Place* place_for(PeerRole role) noexcept;
  Place* free_place() noexcept;
  void drop(Place& place) noexcept;
  void settle_places(std::int64_t now_us) noexcept;
  [[nodiscard]] std::size_t others() const noexcept;
  [[nodiscard]] PeerId id_of(const Place& place) const noexcept;

  RequestHandler* handler_;
  LogRing* log_;
  PeerTable peers_;
  const ModbusConfig config_;
  int listener_ = -1;
  std::vector<Place> places_;
  PeerId last_owner_ = kNoPeer;
  std::int64_t accept_again_us_ = 0;
  std::int64_t log_again_us_ = 0;
};

}  // namespace grapnel
