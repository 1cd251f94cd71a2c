#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "drivers/modbus/adu_assembler.h"
#include "drivers/modbus/request_handler.h"

namespace grapnel {

/// One TCP client: its unfinished request, its untaken answers and its deadlines. Never waits.
class TcpConnection {
 public:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

  /// Takes the socket over; `idle_limit_us` 0: never.
  void open(int socket, const Peer& peer, std::int64_t idle_limit_us, std::int64_t now_us) noexcept;
  /// Closes the socket; returns how many received bytes were never served.
  std::size_t close() noexcept;
  [[nodiscard]] bool is_open() const noexcept { return socket_ >= 0; }
  [[nodiscard]] int socket() const noexcept { return socket_; }
  [[nodiscard]] const Peer& peer() const noexcept { return peer_; }

  /// What to poll for.
  [[nodiscard]] short poll_events() const noexcept;
  /// Receives, serves some requests and sends what the socket takes. False: close it.
  [[nodiscard]] bool serve(short poll_result, RequestHandler& handler,
                           std::int64_t now_us) noexcept;
  /// A complete request waits and its answer has room.
  [[nodiscard]] bool has_work() const noexcept;
  /// When the connection has to be closed unless something happens before.
  [[nodiscard]] std::int64_t deadline_us() const noexcept;
  /// True once a valid request came.
  [[nodiscard]] bool has_spoken() const noexcept { return has_spoken_; }

 private:
  bool receive() noexcept;
  bool answer_requests(RequestHandler& handler, std::int64_t now_us) noexcept;
  bool send_answers(std::int64_t now_us) noexcept;
  [[nodiscard]] bool answer_fits() const noexcept;

  int socket_ = -1;
  Peer peer_;
  AduAssembler in_;
  std::array<std::uint8_t, 2048> out_{};
  std::size_t out_begin_ = 0;
  std::size_t out_end_ = 0;
  std::size_t out_watched_ = 0;  // untaken bytes that the deadline is about
  bool peer_closed_ = false;
  bool has_spoken_ = false;
  std::int64_t idle_limit_us_ = 0;
  std::int64_t last_request_us_ = 0;
  std::int64_t request_deadline_us_ = kNever;
  std::int64_t answer_deadline_us_ = kNever;
};

}  // namespace grapnel
