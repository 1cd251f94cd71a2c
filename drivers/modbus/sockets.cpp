#include "drivers/modbus/sockets.h"

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <utility>

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

namespace grapnel {
namespace {

constexpr int kFirstInheritedFd = 3;  // SD_LISTEN_FDS_START
constexpr int kBacklog = 64;
// Small, so that a client that does not read is noticed soon and costs little memory.
constexpr int kBufferBytes = 8192;
// A peer that vanished without a word is noticed after 5 + 3 × 2 seconds.
constexpr int kKeepIdleS = 5;
constexpr int kKeepIntervalS = 2;
constexpr int kKeepProbes = 3;
constexpr int kUserTimeoutMs = 10'000;

void set_option(int socket, int level, int name, int value) noexcept {
  setsockopt(socket, level, name, &value, sizeof value);
}

void set_buffers(int socket) noexcept {
  set_option(socket, SOL_SOCKET, SO_SNDBUF, kBufferBytes);
  set_option(socket, SOL_SOCKET, SO_RCVBUF, kBufferBytes);
}

std::string failure(const ModbusConfig& config, const char* what) {
  return "modbus: can't " + std::string(what) + " " + config.listen_address + ":" +
         std::to_string(config.port) + ": " + std::strerror(errno);
}

constexpr std::array<std::pair<int, speed_t>, 13> kRates = {{{1200, B1200},
                                                             {2400, B2400},
                                                             {4800, B4800},
                                                             {9600, B9600},
                                                             {19200, B19200},
                                                             {38400, B38400},
                                                             {57600, B57600},
                                                             {115200, B115200},
                                                             {230400, B230400},
                                                             {460800, B460800},
                                                             {500000, B500000},
                                                             {576000, B576000},
                                                             {921600, B921600}}};

speed_t rate_of(int baud) noexcept {
  for (const auto& [number, rate] : kRates) {
    if (number == baud) return rate;
  }
  return B0;
}

bool environment_number(const char* name, long& number) noexcept {
  const char* text = std::getenv(name);
  if (text == nullptr) return false;
  const std::string_view view(text);
  const auto [end, error] = std::from_chars(view.data(), view.data() + view.size(), number);
  return error == std::errc{} && end == view.data() + view.size();
}

}  // namespace

int open_listener(const ModbusConfig& config, std::string& problem) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(config.port));
  if (inet_pton(AF_INET, config.listen_address.c_str(), &address.sin_addr) != 1) {
    problem = "modbus: listen_address: \"" + config.listen_address +
              "\" is not allowed; an IPv4 address is";
    return -1;
  }
  const int listener = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (listener < 0) {
    problem = failure(config, "make a socket for");
    return -1;
  }
  set_option(listener, SOL_SOCKET, SO_REUSEADDR, 1);
  set_buffers(listener);
  if (bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    problem = failure(config, "bind to");
    close(listener);
    return -1;
  }
  if (listen(listener, kBacklog) != 0) {
    problem = failure(config, "listen on");
    close(listener);
    return -1;
  }
  return listener;
}

bool adopt_listener(int socket, std::string& problem) {
  int listening = 0;
  socklen_t length = sizeof listening;
  if (getsockopt(socket, SOL_SOCKET, SO_ACCEPTCONN, &listening, &length) != 0 || listening == 0) {
    problem =
        "modbus: the inherited descriptor " + std::to_string(socket) + " is not a listening socket";
    return false;
  }
  set_buffers(socket);
  fcntl(socket, F_SETFL, fcntl(socket, F_GETFL) | O_NONBLOCK);
  fcntl(socket, F_SETFD, FD_CLOEXEC);
  return true;
}

std::uint16_t local_port(int socket) noexcept {
  sockaddr_in address{};
  socklen_t length = sizeof address;
  if (getsockname(socket, reinterpret_cast<sockaddr*>(&address), &length) != 0) return 0;
  return ntohs(address.sin_port);
}

int accept_client(int listener, std::uint32_t& ipv4) noexcept {
  sockaddr_in address{};
  socklen_t length = sizeof address;
  const int client = accept4(listener, reinterpret_cast<sockaddr*>(&address), &length,
                             SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (client < 0) return -1;
  ipv4 = address.sin_family == AF_INET ? ntohl(address.sin_addr.s_addr) : 0;
  set_option(client, IPPROTO_TCP, TCP_NODELAY, 1);
  set_option(client, SOL_SOCKET, SO_KEEPALIVE, 1);
  set_option(client, IPPROTO_TCP, TCP_KEEPIDLE, kKeepIdleS);
  set_option(client, IPPROTO_TCP, TCP_KEEPINTVL, kKeepIntervalS);
  set_option(client, IPPROTO_TCP, TCP_KEEPCNT, kKeepProbes);
  set_option(client, IPPROTO_TCP, TCP_USER_TIMEOUT, kUserTimeoutMs);
  return client;
}

int inherited_listener() noexcept {
  long pid = 0;
  long count = 0;
  if (!environment_number("LISTEN_PID", pid) || !environment_number("LISTEN_FDS", count)) return -1;
  return pid == getpid() && count >= 1 ? kFirstInheritedFd : -1;
}

bool is_serial_rate(int baud) noexcept { return rate_of(baud) != B0; }

int open_serial(const ModbusConfig& config) noexcept {
  const int line = open(config.rtu_device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (line < 0) return -1;
  termios settings{};
  if (tcgetattr(line, &settings) != 0) {
    close(line);
    return -1;
  }
  cfmakeraw(&settings);
  cfsetspeed(&settings, rate_of(config.rtu_baud));
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | PARENB | PARODD);
  if (config.rtu_stop_bits == 2) settings.c_cflag |= CSTOPB;
  if (config.rtu_parity != SerialParity::None) settings.c_cflag |= PARENB;
  if (config.rtu_parity == SerialParity::Odd) settings.c_cflag |= PARODD;
  settings.c_cc[VMIN] = 0;
  settings.c_cc[VTIME] = 0;
  if (tcsetattr(line, TCSANOW, &settings) != 0) {
    close(line);
    return -1;
  }
  tcflush(line, TCIOFLUSH);
  return line;
}

}  // namespace grapnel
