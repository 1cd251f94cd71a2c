#include "drivers/modbus/adu_assembler.h"

#include <cstring>

namespace grapnel {
namespace {

constexpr std::size_t kLengthEnd = 6;  // transaction, protocol and length fields
constexpr std::size_t kShortest = 2;   // unit id and function code
constexpr std::size_t kLongest = 1 + kMaxPduLength;

}  // namespace

std::span<std::uint8_t> AduAssembler::room() noexcept {
  if (begin_ != 0) {
    std::memmove(bytes_.data(), bytes_.data() + begin_, size());
    end_ -= begin_;
    begin_ = 0;
  }
  return std::span(bytes_).subspan(end_);
}

AduAssembler::Next AduAssembler::next(std::span<const std::uint8_t>& adu) const noexcept {
  const std::span<const std::uint8_t> held(bytes_.data() + begin_, size());
  if (held.size() >= 4 && be16(held, 2) != 0) return Next::Malformed;
  if (held.size() < kLengthEnd) return Next::Incomplete;
  const std::size_t length = be16(held, 4);
  if (length < kShortest || length > kLongest) return Next::Malformed;
  if (held.size() < kLengthEnd + length) return Next::Incomplete;
  adu = held.first(kLengthEnd + length);
  return pdu_length_fits(adu.subspan(kMbapLength)) ? Next::Ready : Next::Malformed;
}

}  // namespace grapnel
