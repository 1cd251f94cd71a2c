#include "tests/drivers/modbus/support/raw_client.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <stdexcept>
#include <utility>

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace grapnel::test {
namespace {

constexpr std::size_t kHead = 7;

sockaddr_in address_of(const std::string& text, std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  inet_pton(AF_INET, text.c_str(), &address.sin_addr);
  return address;
}

}  // namespace

Bytes make_adu(std::uint16_t transaction, std::uint8_t unit, const Bytes& pdu) {
  const std::size_t length = pdu.size() + 1;
  return Bytes{static_cast<std::uint8_t>(transaction >> 8),
               static_cast<std::uint8_t>(transaction & 0xff),
               0,
               0,
               static_cast<std::uint8_t>(length >> 8),
               static_cast<std::uint8_t>(length & 0xff),
               unit} +
         pdu;
}

Bytes operator+(Bytes left, const Bytes& right) {
  left.insert(left.end(), right.begin(), right.end());
  return left;
}

RawClient::RawClient(std::uint16_t port, const std::string& source, int buffer_bytes) {
  socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (buffer_bytes > 0) {
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &buffer_bytes, sizeof buffer_bytes);
    setsockopt(socket_, SOL_SOCKET, SO_SNDBUF, &buffer_bytes, sizeof buffer_bytes);
  }
  const sockaddr_in from = address_of(source, 0);
  const sockaddr_in to = address_of("127.0.0.1", port);
  const bool connected =
      bind(socket_, reinterpret_cast<const sockaddr*>(&from), sizeof from) == 0 &&
      connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0;
  if (!connected) throw std::runtime_error("test client can't connect");
  const int on = 1;
  setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  fcntl(socket_, F_SETFL, O_NONBLOCK);
}

RawClient::RawClient(RawClient&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)),
      closed_(other.closed_),
      received_(std::move(other.received_)) {}

RawClient::~RawClient() { close(); }

void RawClient::close() {
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
}

void RawClient::shut_sending() { shutdown(socket_, SHUT_WR); }

std::size_t RawClient::send(const Bytes& bytes) {
  const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (sent < 0 && errno != EAGAIN) closed_ = true;
  return sent > 0 ? static_cast<std::size_t>(sent) : 0;
}

void RawClient::receive() {
  std::array<std::uint8_t, 4096> bytes;
  while (!closed_) {
    const ssize_t count = recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (count <= 0) {
      closed_ = true;
      return;
    }
    received_.insert(received_.end(), bytes.begin(), bytes.begin() + count);
  }
}

Bytes RawClient::take(std::size_t count) {
  const auto end =
      received_.begin() + static_cast<std::ptrdiff_t>(std::min(count, received_.size()));
  Bytes taken(received_.begin(), end);
  received_.erase(received_.begin(), end);
  return taken;
}

Bytes RawClient::take_answer() {
  receive();
  if (received_.size() < kHead) return {};
  const std::size_t length = 6 + (static_cast<std::size_t>(received_[4]) << 8 | received_[5]);
  return received_.size() < length ? Bytes{} : take(length);
}

Bytes RawClient::wait_answer(int timeout_ms) {
  using Time = std::chrono::steady_clock;
  const Time::time_point end = Time::now() + std::chrono::milliseconds(timeout_ms);
  while (true) {
    Bytes answer = take_answer();
    if (!answer.empty() || closed_) return answer;
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(end - Time::now()).count();
    if (left <= 0) return {};
    pollfd entry{socket_, POLLIN, 0};
    poll(&entry, 1, static_cast<int>(left));
  }
}

}  // namespace grapnel::test
