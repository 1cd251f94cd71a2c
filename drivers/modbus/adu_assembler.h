#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/modbus/pdu.h"

namespace grapnel {

/// Cuts a TCP byte stream into requests and checks their framing: protocol id 0, length 2…254 and
/// the one that the function code asks for. Fixed buffer; holds several pipelined requests.
class AduAssembler {
 public:
  enum class Next : std::uint8_t {
    Incomplete,  ///< more bytes are needed (or none came)
    Ready,
    Malformed,  ///< the stream can't be trusted any more: close it
  };

  /// Free space to receive into; then received() says how much came.
  [[nodiscard]] std::span<std::uint8_t> room() noexcept;
  void received(std::size_t bytes) noexcept { end_ += bytes; }

  /// The first request; `adu` stays valid until consume() or room().
  [[nodiscard]] Next next(std::span<const std::uint8_t>& adu) const noexcept;
  /// Drops the request that next() gave.
  void consume(std::size_t bytes) noexcept { begin_ += bytes; }
  void clear() noexcept { begin_ = end_ = 0; }
  /// Bytes held.
  [[nodiscard]] std::size_t size() const noexcept { return end_ - begin_; }
  /// False when a full buffer has to be worked off before more can be received.
  [[nodiscard]] bool has_room() const noexcept { return size() < bytes_.size(); }

 private:
  std::array<std::uint8_t, 1024> bytes_{};
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
};

}  // namespace grapnel
