#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace grapnel::test {

/// Feeds bytes to the server's framing and request handling as a client could: the first byte says
/// who it is and how the stream is cut into pieces, the rest is the stream. Aborts when an answer
/// or the register image breaks a rule. Returns how many requests were answered.
std::size_t run_modbus_stream(std::span<const std::uint8_t> input);

/// The same bytes as a serial line's frames.
void run_rtu_stream(std::span<const std::uint8_t> input);

}  // namespace grapnel::test
