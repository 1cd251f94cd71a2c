#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include <modbus/modbus.h>

#include "base/error.h"
#include "drivers/modbus/register_image.h"

namespace grapnel {

/// libmodbus on the inside of a local socket pair: it is handed one complete, checked request at a
/// time and leaves its answer in the pair's buffer, so it never meets the network, never waits for
/// a client and never sees a partial telegram. Two system calls a request, no heap after open().
class PduEngine {
 public:
  /// `image` must outlive the engine.
  explicit PduEngine(RegisterImage& image) noexcept;
  PduEngine(const PduEngine&) = delete;
  PduEngine& operator=(const PduEngine&) = delete;
  ~PduEngine();

  /// Error detail: errno.
  Status open();
  /// Answers a checked request of functions 3, 4, 6 or 16 in MBAP framing. Length of the answer in
  /// `out` (kMaxAduLength bytes), 0 when the library failed.
  [[nodiscard]] std::size_t answer(std::span<const std::uint8_t> adu,
                                   std::span<std::uint8_t> out) noexcept;

 private:
  struct ContextDeleter {
    void operator()(modbus_t* context) const noexcept { modbus_free(context); }
  };

  std::unique_ptr<modbus_t, ContextDeleter> context_;
  modbus_mapping_t mapping_{};
  int library_end_ = -1;
  int our_end_ = -1;
};

}  // namespace grapnel
