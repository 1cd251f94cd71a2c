#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/modbus/modbus_config.h"

namespace grapnel {

/// What a peer may do.
enum class PeerRole : std::uint8_t { Refused, Read, Control };

/// The allow-list of addresses.
class PeerTable {
 public:
  /// Takes the lists of the configuration; false with `problem` (one line) when an entry is not an
  /// IPv4 address or network.
  [[nodiscard]] bool load(const ModbusConfig& config, std::string& problem);
  /// Role of the longest matching entry; Refused when none matches. Host byte order.
  [[nodiscard]] PeerRole role(std::uint32_t ipv4) const noexcept;

 private:
  struct Entry {
    std::uint32_t network = 0;
    int prefix = 32;
    PeerRole role = PeerRole::Refused;
  };

  std::vector<Entry> entries_;  // longest prefix first
};

}  // namespace grapnel
