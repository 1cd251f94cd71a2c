#include "drivers/modbus/tcp_connection.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace grapnel {
namespace {

constexpr std::int64_t kRequestLimitUs = 1'000'000;  // first to last byte of a request
constexpr std::int64_t kAnswerLimitUs = 200'000;     // an answer that the client does not take
constexpr int kRequestsPerTurn = 4;                  // then the other clients have their turn

bool would_block() noexcept { return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR; }

}  // namespace

void TcpConnection::open(int socket, const Peer& peer, std::int64_t idle_limit_us,
                         std::int64_t now_us) noexcept {
  socket_ = socket;
  peer_ = peer;
  in_.clear();
  out_begin_ = out_end_ = out_watched_ = 0;
  peer_closed_ = false;
  has_spoken_ = false;
  idle_limit_us_ = idle_limit_us;
  last_request_us_ = now_us;
  request_deadline_us_ = kNever;
  answer_deadline_us_ = kNever;
}

std::size_t TcpConnection::close() noexcept {
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
  const std::size_t unserved = in_.size();
  in_.clear();
  return unserved;
}

bool TcpConnection::answer_fits() const noexcept {
  return out_.size() - (out_end_ - out_begin_) >= kMaxAduLength;
}

bool TcpConnection::has_work() const noexcept {
  std::span<const std::uint8_t> adu;
  return is_open() && answer_fits() && in_.next(adu) != AduAssembler::Next::Incomplete;
}

short TcpConnection::poll_events() const noexcept {
  const int in = !peer_closed_ && in_.has_room() ? POLLIN : 0;
  const int out = out_end_ != out_begin_ ? POLLOUT : 0;
  return static_cast<short>(in | out);
}

std::int64_t TcpConnection::deadline_us() const noexcept {
  const std::int64_t idle_deadline_us =
      idle_limit_us_ == 0 ? kNever : last_request_us_ + idle_limit_us_;
  return std::min({request_deadline_us_, answer_deadline_us_, idle_deadline_us});
}

bool TcpConnection::serve(short poll_result, RequestHandler& handler,
                          std::int64_t now_us) noexcept {
  if ((poll_result & (POLLERR | POLLNVAL)) != 0) return false;
  if ((poll_result & (POLLIN | POLLHUP)) != 0 && in_.has_room() && !receive()) return false;
  if (!answer_requests(handler, now_us)) return false;
  if (!send_answers(now_us)) return false;
  if (peer_closed_ && out_begin_ == out_end_ && !has_work()) return false;
  return now_us < deadline_us();
}

bool TcpConnection::receive() noexcept {
  const std::span<std::uint8_t> room = in_.room();
  const ssize_t count = recv(socket_, room.data(), room.size(), MSG_DONTWAIT);
  if (count < 0) return would_block();
  if (count == 0) peer_closed_ = true;
  in_.received(static_cast<std::size_t>(count));
  return true;
}

bool TcpConnection::answer_requests(RequestHandler& handler, std::int64_t now_us) noexcept {
  for (int i = 0; i < kRequestsPerTurn && answer_fits(); ++i) {
    std::span<const std::uint8_t> adu;
    const AduAssembler::Next next = in_.next(adu);
    if (next == AduAssembler::Next::Malformed) return false;
    if (next == AduAssembler::Next::Incomplete) {
      if (in_.size() == 0) request_deadline_us_ = kNever;
      if (in_.size() != 0 && request_deadline_us_ == kNever) {
        request_deadline_us_ = now_us + kRequestLimitUs;
      }
      return true;
    }
    if (out_begin_ != 0) {
      std::memmove(out_.data(), out_.data() + out_begin_, out_end_ - out_begin_);
      out_end_ -= out_begin_;
      out_begin_ = 0;
    }
    out_end_ += handler.answer(peer_, adu, std::span(out_).subspan(out_end_), now_us);
    in_.consume(adu.size());
    has_spoken_ = true;
    last_request_us_ = now_us;
    request_deadline_us_ = kNever;
  }
  return true;
}

bool TcpConnection::send_answers(std::int64_t now_us) noexcept {
  const std::size_t pending = out_end_ - out_begin_;
  if (pending == 0) return true;
  ssize_t sent = send(socket_, out_.data() + out_begin_, pending, MSG_DONTWAIT | MSG_NOSIGNAL);
  if (sent < 0) {
    if (!would_block()) return false;
    sent = 0;
  }
  const auto taken = static_cast<std::size_t>(sent);
  out_begin_ += taken;
  if (taken == pending) {
    out_begin_ = out_end_ = out_watched_ = 0;
    answer_deadline_us_ = kNever;
    return true;
  }
  // What was pending when the deadline was set has to go as a whole: a byte now and then does not
  // count as reading.
  if (taken >= out_watched_ || answer_deadline_us_ == kNever) {
    out_watched_ = pending - taken;
    answer_deadline_us_ = now_us + kAnswerLimitUs;
  } else {
    out_watched_ -= taken;
  }
  return true;
}

}  // namespace grapnel
