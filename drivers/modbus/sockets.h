#pragma once

#include <cstdint>
#include <string>

#include "drivers/modbus/modbus_config.h"

namespace grapnel {

/// Opens a non-blocking listener on the configured address and port. The socket, or -1 with
/// `problem` in one line.
[[nodiscard]] int open_listener(const ModbusConfig& config, std::string& problem);

/// Makes an inherited listening socket fit: non-blocking, small buffers. False with `problem` when
/// it is not a listening TCP socket.
[[nodiscard]] bool adopt_listener(int socket, std::string& problem);

/// Port that a listener is bound to, 0 when unknown.
[[nodiscard]] std::uint16_t local_port(int socket) noexcept;

/// Accepts one waiting client: non-blocking, no delay, keep-alive. The socket, or -1 with errno.
/// `ipv4` is its address in host byte order.
[[nodiscard]] int accept_client(int listener, std::uint32_t& ipv4) noexcept;

/// The first socket handed over by systemd (LISTEN_PID, LISTEN_FDS), or -1.
[[nodiscard]] int inherited_listener() noexcept;

/// Opens a serial line, raw and non-blocking. The descriptor, or -1 with errno. No heap.
[[nodiscard]] int open_serial(const ModbusConfig& config) noexcept;

/// True when `baud` is a rate that open_serial() knows.
[[nodiscard]] bool is_serial_rate(int baud) noexcept;

}  // namespace grapnel
