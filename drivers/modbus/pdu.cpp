#include "drivers/modbus/pdu.h"

#include "drivers/modbus/registers.h"

namespace grapnel {
namespace {

// Limits of the protocol (Modbus Application Protocol V1.1b3, 6.3, 6.12 and 6.17).
constexpr std::uint16_t kMaxRead = 125;
constexpr std::uint16_t kMaxWrite = 123;
constexpr std::uint16_t kMaxReadWriteWrite = 121;

constexpr std::size_t kWriteMultipleHead = 6;
constexpr std::size_t kReadWriteHead = 10;

bool inside(std::uint32_t first, std::uint32_t count, std::uint32_t low,
            std::uint32_t high) noexcept {
  return first >= low && first + count <= high + 1;
}

bool readable(const PduRequest& request) noexcept {
  namespace c = registers::command;
  const bool input = inside(request.read_first, request.read_count, registers::kFirstReadOnly,
                            registers::kLastReadOnly);
  if (request.function == ModbusFunction::ReadInput) return input;
  return input || inside(request.read_first, request.read_count, c::kFirst, c::kLast);
}

}  // namespace

bool pdu_length_fits(std::span<const std::uint8_t> pdu) noexcept {
  switch (static_cast<ModbusFunction>(pdu[0])) {
    case ModbusFunction::ReadHolding:
    case ModbusFunction::ReadInput:
    case ModbusFunction::WriteSingle:
      return pdu.size() == 5;
    case ModbusFunction::WriteMultiple:
      return pdu.size() >= kWriteMultipleHead && pdu.size() == kWriteMultipleHead + pdu[5];
    case ModbusFunction::ReadWrite:
      return pdu.size() >= kReadWriteHead && pdu.size() == kReadWriteHead + pdu[9];
    case ModbusFunction::EncapsulatedTransport:
      return pdu.size() >= 2 && (pdu[1] != kReadDeviceIdentification || pdu.size() == 4);
  }
  return true;
}

ModbusException parse_request(std::span<const std::uint8_t> pdu, PduRequest& request) noexcept {
  request = PduRequest{};
  request.function = static_cast<ModbusFunction>(pdu[0]);
  switch (request.function) {
    case ModbusFunction::ReadHolding:
    case ModbusFunction::ReadInput:
      if (!pdu_length_fits(pdu)) return ModbusException::IllegalValue;
      request.read_first = be16(pdu, 1);
      request.read_count = be16(pdu, 3);
      break;
    case ModbusFunction::WriteSingle:
      if (!pdu_length_fits(pdu)) return ModbusException::IllegalValue;
      request.write_first = be16(pdu, 1);
      request.write_count = 1;
      request.write_data = pdu.subspan(3);
      return ModbusException::None;
    case ModbusFunction::WriteMultiple:
      if (!pdu_length_fits(pdu)) return ModbusException::IllegalValue;
      request.write_first = be16(pdu, 1);
      request.write_count = be16(pdu, 3);
      request.write_data = pdu.subspan(kWriteMultipleHead);
      if (request.write_count < 1 || request.write_count > kMaxWrite ||
          request.write_data.size() != std::size_t{2} * request.write_count) {
        return ModbusException::IllegalValue;
      }
      return ModbusException::None;
    case ModbusFunction::ReadWrite:
      if (!pdu_length_fits(pdu)) return ModbusException::IllegalValue;
      request.read_first = be16(pdu, 1);
      request.read_count = be16(pdu, 3);
      request.write_first = be16(pdu, 5);
      request.write_count = be16(pdu, 7);
      request.write_data = pdu.subspan(kReadWriteHead);
      if (request.write_count < 1 || request.write_count > kMaxReadWriteWrite ||
          request.write_data.size() != std::size_t{2} * request.write_count) {
        return ModbusException::IllegalValue;
      }
      break;
    case ModbusFunction::EncapsulatedTransport:
      if (pdu.size() < 2 || pdu[1] != kReadDeviceIdentification) {
        return ModbusException::IllegalFunction;
      }
      return pdu_length_fits(pdu) ? ModbusException::None : ModbusException::IllegalValue;
    default:
      return ModbusException::IllegalFunction;
  }
  const bool count_ok = request.read_count >= 1 && request.read_count <= kMaxRead;
  return count_ok ? ModbusException::None : ModbusException::IllegalValue;
}

ModbusException check_addresses(const PduRequest& request) noexcept {
  namespace c = registers::command;
  if (request.read_count != 0 && !readable(request)) return ModbusException::IllegalAddress;
  if (request.writes() && !inside(request.write_first, request.write_count, c::kFirst, c::kLast)) {
    return ModbusException::IllegalAddress;
  }
  return ModbusException::None;
}

}  // namespace grapnel
