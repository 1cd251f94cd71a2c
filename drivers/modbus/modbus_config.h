#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/field.h"

namespace grapnel {

/// Which register of a 32-bit value comes first: ABCD the high word, CDAB the low word.
enum class WordOrder : std::uint8_t { Abcd, Cdab };

enum class SerialParity : std::uint8_t { None, Even, Odd };

/// The field bus as configured. Peers are IPv4 addresses or networks ("192.168.3.10",
/// "192.168.3.0/24"); the longest match decides, a peer that matches nothing is refused.
struct ModbusConfig {
  std::string listen_address = "127.0.0.1";  ///< one address; empty: no TCP
  int port = 502;                            ///< 0: any free one (tests)
  std::vector<std::string> control_peers = {"127.0.0.1"};
  std::vector<std::string> read_peers;
  std::vector<double> unit_ids = {0, 1, 255};
  bool strict_unit_id = false;
  int max_connections = 16;
  WordOrder word_order = WordOrder::Abcd;
  int control_idle_limit_s = 0;  ///< 0: never
  int read_idle_limit_s = 60;    ///< 0: never
  std::string rtu_device;        ///< empty: no RTU
  int rtu_baud = 19200;
  SerialParity rtu_parity = SerialParity::Even;
  int rtu_stop_bits = 1;
  int rtu_slave_id = 1;
  int rtu_silence_us = 0;  ///< silence that ends a frame; 0: 3.5 characters, at least 1750 us
};

/// Rows of ModbusConfig, for `[modbus]` in grapnel.toml.
[[nodiscard]] FieldTable modbus_fields() noexcept;

}  // namespace grapnel
