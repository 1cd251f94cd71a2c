#include "drivers/modbus/peer_table.h"

#include <algorithm>
#include <charconv>

#include <arpa/inet.h>

namespace grapnel {
namespace {

std::uint32_t mask(int prefix) noexcept {
  return prefix == 0 ? 0u : ~std::uint32_t{0} << (32 - prefix);
}

bool parse_network(const std::string& text, std::uint32_t& network, int& prefix) {
  const std::size_t slash = text.find('/');
  in_addr address{};
  if (inet_pton(AF_INET, text.substr(0, slash).c_str(), &address) != 1) return false;
  network = ntohl(address.s_addr);
  prefix = 32;
  if (slash == std::string::npos) return true;
  const char* begin = text.data() + slash + 1;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(begin, end, prefix);
  const bool number = error == std::errc{} && stop == end && prefix >= 0 && prefix <= 32;
  return number && (network & ~mask(prefix)) == 0;
}

}  // namespace

bool PeerTable::load(const ModbusConfig& config, std::string& problem) {
  entries_.clear();
  for (const bool control : {true, false}) {
    for (const std::string& text : control ? config.control_peers : config.read_peers) {
      Entry entry;
      entry.role = control ? PeerRole::Control : PeerRole::Read;
      if (!parse_network(text, entry.network, entry.prefix)) {
        problem = std::string(control ? "control_peers" : "read_peers") + ": \"" + text +
                  "\" is not allowed; an IPv4 address or network like 192.168.3.0/24 is";
        return false;
      }
      entries_.push_back(entry);
    }
  }
  std::stable_sort(entries_.begin(), entries_.end(),
                   [](const Entry& a, const Entry& b) { return a.prefix > b.prefix; });
  return true;
}

PeerRole PeerTable::role(std::uint32_t ipv4) const noexcept {
  for (const Entry& entry : entries_) {
    if ((ipv4 & mask(entry.prefix)) == entry.network) return entry.role;
  }
  return PeerRole::Refused;
}

}  // namespace grapnel
