#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace grapnel::test {

using Bytes = std::vector<std::uint8_t>;

/// MBAP head and PDU.
[[nodiscard]] Bytes make_adu(std::uint16_t transaction, std::uint8_t unit, const Bytes& pdu);

/// Joins byte strings.
[[nodiscard]] Bytes operator+(Bytes left, const Bytes& right);

/// A TCP client that sends any bytes.
class RawClient {
 public:
  /// Connects from `source`, any loopback address; 0 leaves the socket's buffers as they are.
  explicit RawClient(std::uint16_t port, const std::string& source = "127.0.0.1",
                     int buffer_bytes = 0);
  RawClient(RawClient&& other) noexcept;
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;
  ~RawClient();

  /// Bytes that the socket took, never waiting.
  std::size_t send(const Bytes& bytes);
  /// What has arrived, at once.
  void receive();
  /// Takes `count` bytes of what has arrived; fewer when there are fewer.
  [[nodiscard]] Bytes take(std::size_t count);
  /// Takes the first whole answer; empty when none is complete.
  [[nodiscard]] Bytes take_answer();
  [[nodiscard]] bool closed_by_server() const noexcept { return closed_; }
  [[nodiscard]] int socket() const noexcept { return socket_; }
  void close();
  /// No more requests; answers can still come.
  void shut_sending();

  /// Waits up to `timeout_ms` for a whole answer; for servers on another thread.
  [[nodiscard]] Bytes wait_answer(int timeout_ms);

 private:
  int socket_ = -1;
  bool closed_ = false;
  Bytes received_;
};

}  // namespace grapnel::test
