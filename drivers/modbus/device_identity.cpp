#include "drivers/modbus/device_identity.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace grapnel {
namespace {

constexpr std::uint8_t kBasicObjects = 3;
constexpr std::uint8_t kRegularObjects = 7;
constexpr std::uint8_t kConformity = 0x82;  // regular, stream and individual access
constexpr std::size_t kHead = 7;
constexpr std::size_t kLongestText = 60;

enum ReadCode : std::uint8_t { Basic = 1, Regular = 2, Extended = 3, Individual = 4 };

std::array<std::string_view, kRegularObjects> texts(const DeviceIdentity& identity) noexcept {
  return {identity.vendor,          identity.product_code, identity.revision,
          identity.vendor_url,      identity.product_name, identity.model_name,
          identity.application_name};
}

}  // namespace

std::size_t answer_identification(std::span<const std::uint8_t> pdu, const DeviceIdentity& identity,
                                  std::span<std::uint8_t> out,
                                  ModbusException& exception) noexcept {
  const std::uint8_t code = pdu[2];
  std::uint8_t first = pdu[3];
  exception = ModbusException::None;
  if (code < Basic || code > Individual) {
    exception = ModbusException::IllegalValue;
    return 0;
  }
  std::uint8_t end = code == Basic ? kBasicObjects : kRegularObjects;
  if (code == Individual) {
    if (first >= kRegularObjects) {
      exception = ModbusException::IllegalAddress;
      return 0;
    }
    end = static_cast<std::uint8_t>(first + 1);
  } else if (first >= end) {
    first = 0;  // the standard restarts at the beginning
  }
  const auto objects = texts(identity);
  out[0] = static_cast<std::uint8_t>(ModbusFunction::EncapsulatedTransport);
  out[1] = kReadDeviceIdentification;
  out[2] = code;
  out[3] = kConformity;
  std::size_t at = kHead;
  std::uint8_t id = first;
  for (; id < end; ++id) {
    const std::string_view text = objects[id].substr(0, kLongestText);
    if (at + 2 + text.size() > kMaxPduLength) break;
    out[at] = id;
    out[at + 1] = static_cast<std::uint8_t>(text.size());
    std::copy(text.begin(), text.end(), out.begin() + static_cast<std::ptrdiff_t>(at + 2));
    at += 2 + text.size();
  }
  const bool more = id < end;
  out[4] = more ? 0xff : 0x00;
  out[5] = more ? id : std::uint8_t{0};
  out[6] = static_cast<std::uint8_t>(id - first);
  return at;
}

}  // namespace grapnel
